#include "joint_tables.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

#include "angles.h"
#include "layfigure/doll/settings.h"
#include "override_names.h"
#include "toml_text.h"
#include "value_range.h"

namespace layfigure::doll {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMostOfJoint = 1e18;  // above those of a giant of a kilometre
constexpr ValueRange kFactors{0.0, 1e6, false};
constexpr double kHalfTurnDeg = 180.0;

struct AmountKey {
  std::string_view name;
  OptionalEntry<Amount> JointOverride::*entry;
  ValueRange range;
  OptionalEntry<AxisAmounts> JointOverride::*axes{nullptr};  ///< nullptr: the axes have one value
  bool axis_may_vanish{true};
};

constexpr std::array<AmountKey, 5> kAmounts{{
    {"stiffness", &JointOverride::stiffness, {0.0, kInfinity}, &JointOverride::stiffness_axes},
    {"damping", &JointOverride::damping, {0.0, kMostOfJoint}, &JointOverride::damping_axes},
    {"flow_damping", &JointOverride::flow_damping, {0.0, kMostOfJoint}},
    {"yield_torque", &JointOverride::yield_torque, {0.0, kInfinity}, &JointOverride::yield_torque_axes, false},
    {"hardening", &JointOverride::hardening, {0.0, kMostOfJoint}},
}};

struct NumberKey {
  std::string_view name;
  OptionalEntry<double> JointOverride::*entry;
  ValueRange range;
};

constexpr std::array<NumberKey, 3> kNumbers{{
    {"friction", &JointOverride::friction, {0.0, 1e6}},
    {"density", &JointOverride::density, {0.0, 1e6, false}},
    {"mass", &JointOverride::mass, {0.0, 1e6, false}},
}};

struct LimitKey {
  std::string_view name;
  OptionalEntry<AngleRange> JointOverride::*entry;
  double least_deg;  ///< that each bound is away from the neutral pose
};

constexpr std::array<LimitKey, 3> kLimits{{
    {"twist", &JointOverride::twist, 0.0},
    {"swing_y", &JointOverride::swing_y, kLeastSwingDeg},
    {"swing_z", &JointOverride::swing_z, kLeastSwingDeg},
}};

template <class Keys>
std::string list_names(const Keys& keys) {
  std::string list;
  for (const auto& key : keys) list.append(list.empty() ? "" : ", ").append(key.name);
  return list;
}

template <std::size_t n>
std::string list_names(const std::array<std::string_view, n>& names) {
  std::string list;
  for (const std::string_view name : names) list.append(list.empty() ? "" : ", ").append(name);
  return list;
}

template <std::size_t n>
int index_of(const std::array<std::string_view, n>& names, std::string_view name) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

/// One table [joints."PATTERN"].
class JointTable {
 public:
  JointTable(const std::string& file, std::string_view pattern) : file_(file), pattern_(pattern) {}

  [[nodiscard]] JointOverride read(const toml::table& table) const {
    JointOverride joint;
    joint.pattern = pattern_;
    joint.line = line_of(table);
    for (const auto& [key, node] : table) read_key(key.str(), node, joint);
    if (joint.density && joint.mass) refuse_at(table, "density and mass: expected only one of them");
    return joint;
  }

  [[noreturn]] void refuse_at(const toml::node& node, const std::string& why) const {
    refuse(file_, node.source(), "[joints." + toml_key(pattern_) + "] " + why);
  }

 private:
  static int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

  void read_key(std::string_view key, const toml::node& node, JointOverride& joint) const {
    for (const AmountKey& amount : kAmounts) {
      if (key == amount.name) return read_amounts(amount, node, joint);
    }
    for (const NumberKey& number : kNumbers) {
      if (key == number.name) return set(joint.*number.entry, read_number(key, node, number.range), node);
    }
    if (key == "limits") return read_limits(node, joint);
    if (key == "locked") return set(joint.locked, read_locked(node), node);
    if (key == "merge") return set(joint.merge, read_flag(key, node), node);
    if (key == "shape") return set(joint.shape, read_shape(node), node);
    refuse_at(node, "unknown key '" + toml_comment(key) + "', expected one of " + list_names(kAmounts) +
                        ", limits, locked, merge, shape, " + list_names(kNumbers));
  }

  template <class T>
  static void set(OptionalEntry<T>& entry, const T& value, const toml::node& node) {
    entry = {value, line_of(node)};
  }

  [[nodiscard]] double read_number(std::string_view name, const toml::node& node, const ValueRange& range) const {
    if (!node.is_number()) refuse_at(node, std::string(name) + ": expected a number");
    const double value = *node.value<double>();
    if (const std::string why = range_complaint(name, value, range); !why.empty()) refuse_at(node, why);
    return value;
  }

  [[nodiscard]] bool read_flag(std::string_view name, const toml::node& node) const {
    if (!node.is_boolean()) refuse_at(node, std::string(name) + ": expected true or false");
    return *node.value<bool>();
  }

  void read_amounts(const AmountKey& key, const toml::node& node, JointOverride& joint) const {
    if (key.axes != nullptr && names_axes(node)) {
      set(joint.*key.axes, read_axes(key, *node.as_table()), node);
    } else {
      set(joint.*key.entry, read_amount(std::string(key.name), key.range, node, key.axes != nullptr), node);
    }
  }

  static bool names_axes(const toml::node& node) {
    const toml::table* table = node.as_table();
    return table != nullptr && std::any_of(table->begin(), table->end(), [](const auto& entry) {
             return index_of(kAxisNames, entry.first.str()) >= 0;
           });
  }

  [[nodiscard]] Amount read_amount(const std::string& name, const ValueRange& range, const toml::node& node,
                                   bool may_be_axes) const {
    const std::string expected = name + ": expected a number or {factor = NUMBER}" +
                                 (may_be_axes ? ", or a table of these for " + list_names(kAxisNames) : "");
    const toml::table* table = node.as_table();
    if (table == nullptr) {
      if (!node.is_number()) refuse_at(node, expected);
      return {read_number(name, node, range), false};
    }
    const toml::node* factor = table->get("factor");
    if (factor == nullptr || table->size() != 1) refuse_at(node, expected);
    return {read_number(name + ".factor", *factor, kFactors), true};
  }

  [[nodiscard]] AxisAmounts read_axes(const AmountKey& key, const toml::table& table) const {
    const ValueRange range{key.range.least, key.range.most, key.axis_may_vanish};
    AxisAmounts axes;
    for (const auto& [axis, node] : table) {
      const int index = index_of(kAxisNames, axis.str());
      if (index < 0) {
        refuse_at(node, std::string(key.name) + ": unknown axis '" + toml_comment(axis.str()) + "', expected one of " +
                            list_names(kAxisNames));
      }
      axes[index] = read_amount(std::string(key.name) + "." + std::string(kAxisNames[index]), range, node, false);
    }
    return axes;
  }

  void read_limits(const toml::node& node, JointOverride& joint) const {
    const toml::table* table = node.as_table();
    if (table == nullptr || table->empty()) {
      refuse_at(node,
                "limits: expected a table such as {twist = [-30, 30]} of " + list_names(kLimits) + ", in degrees");
    }
    for (const auto& [key, value] : *table) {
      const auto limit = std::find_if(kLimits.begin(), kLimits.end(), [&](const auto& l) { return key == l.name; });
      if (limit == kLimits.end()) {
        refuse_at(value,
                  "limits: unknown axis '" + toml_comment(key.str()) + "', expected one of " + list_names(kLimits));
      }
      set(joint.*limit->entry, read_angles(*limit, value), value);
    }
  }

  [[nodiscard]] AngleRange read_angles(const LimitKey& key, const toml::node& node) const {
    const std::string name = "limits." + std::string(key.name);
    const toml::array* pair = node.as_array();
    if (pair == nullptr || pair->size() != 2) {
      refuse_at(node, name + ": expected [lower, upper] in degrees, such as [-30, 30]");
    }
    const auto bound = [&](std::size_t index, const char* which) {
      return read_number(name + which, *pair->get(index), {-kHalfTurnDeg, kHalfTurnDeg});
    };
    const double lower = bound(0, " lower");
    const double upper = bound(1, " upper");
    if (lower > upper) refuse_at(node, name + ": the lower bound is above the upper one");
    if (lower > 0.0 || upper < 0.0) {
      refuse_at(node, name +
                          ": the neutral pose, 0, is outside; expected the lower bound in [-180, 0], the upper in "
                          "[0, 180]");
    }
    return {to_radians(std::min(lower, -key.least_deg)), to_radians(std::max(upper, key.least_deg))};
  }

  [[nodiscard]] std::array<bool, 3> read_locked(const toml::node& node) const {
    const std::string expected = "expected a list of " + list_names(kAxisNames);
    const toml::array* axes = node.as_array();
    if (axes == nullptr) refuse_at(node, "locked: " + expected);
    std::array<bool, 3> locked{false, false, false};
    for (const toml::node& element : *axes) {
      if (!element.is_string()) refuse_at(element, "locked: " + expected);
      const std::string name = *element.value<std::string>();
      const int axis = index_of(kAxisNames, name);
      if (axis < 0) refuse_at(element, "locked: unknown axis '" + toml_comment(name) + "', " + expected);
      locked[axis] = true;
    }
    return locked;
  }

  [[nodiscard]] ShapeKind read_shape(const toml::node& node) const {
    const std::string name = node.value<std::string>().value_or("");
    const int kind = index_of(kShapeNames, name);
    if (kind < 0) refuse_at(node, "shape: expected one of " + list_names(kShapeNames) + ", in quotes");
    return static_cast<ShapeKind>(kind);
  }

  const std::string& file_;
  std::string pattern_;
};

bool comes_before(const toml::node* a, const toml::node* b) {
  const toml::source_position& p = a->source().begin;
  const toml::source_position& q = b->source().begin;
  return p.line != q.line ? p.line < q.line : p.column < q.column;
}

}  // namespace

void refuse(const std::string& file, const toml::source_region& where, const std::string& why) {
  throw SettingsError(file + ":" + std::to_string(where.begin.line) + ": " + why);
}

std::vector<JointOverride> read_joint_tables(const std::string& file, const toml::node& joints) {
  const toml::table* tables = joints.as_table();
  if (tables == nullptr) refuse(file, joints.source(), "joints: expected tables such as [joints.\"*Arm\"]");
  std::vector<std::pair<const toml::node*, JointOverride>> found;
  for (const auto& [pattern, node] : *tables) {
    const JointTable reader(file, pattern.str());
    if (!node.is_table()) reader.refuse_at(node, "expected a table");
    found.emplace_back(&node, reader.read(*node.as_table()));
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return comes_before(a.first, b.first); });
  std::vector<JointOverride> result;
  for (auto& [node, joint] : found) result.push_back(std::move(joint));
  return result;
}

}  // namespace layfigure::doll
