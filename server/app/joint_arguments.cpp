#include "layfigure/app/joint_arguments.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>
#include <string>

#include "layfigure/doll/settings.h"

namespace layfigure::app {
namespace {

using doll::Amount;
using doll::JointOverride;
template <class T>
using Field = doll::OptionalEntry<T> JointOverride::*;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMostGain = 1e12;   // keeps products finite, as in a settings file
constexpr double kMostFactor = 1e6;  // likewise
constexpr double kLeastSwing = doll::kLeastSwingDeg * std::numbers::pi / 180.0;

struct Law {
  std::string name;
  double most;  ///< infinity: has a meaning of its own
  Field<Amount> whole;
  Field<doll::AxisAmounts> axes;  ///< null: has none
};

const std::array<Law, 5>& laws() {
  static const std::array<Law, 5> kLaws{
      {{"stiffness", kInfinity, &JointOverride::stiffness, &JointOverride::stiffness_axes},
       {"damping", kMostGain, &JointOverride::damping, &JointOverride::damping_axes},
       {"yield_torque", kInfinity, &JointOverride::yield_torque, &JointOverride::yield_torque_axes},
       {"flow_damping", kMostGain, &JointOverride::flow_damping, nullptr},
       {"hardening", kMostGain, &JointOverride::hardening, nullptr}}};
  return kLaws;
}

constexpr std::array<const char*, 3> kLawAxes{".twist", ".bend_y", ".bend_z"};

struct Limit {
  std::string name;
  Field<doll::AngleRange> range;
};

const std::array<Limit, 3>& limits() {
  static const std::array<Limit, 3> kLimits{{{"limits.twist", &JointOverride::twist},
                                             {"limits.swing_y", &JointOverride::swing_y},
                                             {"limits.swing_z", &JointOverride::swing_z}}};
  return kLimits;
}

std::vector<std::string> make_names() {
  std::vector<std::string> names;
  const auto add = [&](const std::string& name) {
    names.push_back(name);
    names.push_back(name + ".factor");
  };
  for (const Law& law : laws()) {
    add(law.name);
    if (law.axes == nullptr) continue;
    for (const char* axis : kLawAxes) add(law.name + axis);
  }
  for (const Limit& limit : limits()) names.push_back(limit.name);
  return names;
}

std::optional<Amount> amount(const Arguments& arguments, const std::string& name, double most) {
  const std::optional<double> number = arguments.number(name, 0.0, most);
  const std::optional<double> factor = arguments.number(name + ".factor", 0.0, kMostFactor);
  if (number && factor) throw Refusal("arguments '" + name + "' and '" + name + ".factor' contradict each other");
  if (number) return Amount{*number, false};
  return factor ? std::optional(Amount{*factor, true}) : std::nullopt;
}

void take_law(const Arguments& arguments, const Law& law, JointOverride& wish) {
  if (const std::optional<Amount> whole = amount(arguments, law.name, law.most)) wish.*law.whole = {*whole, 0};
  if (law.axes == nullptr) return;
  doll::AxisAmounts axes;
  for (std::size_t k = 0; k < kLawAxes.size(); ++k) axes[k] = amount(arguments, law.name + kLawAxes[k], law.most);
  if (std::ranges::none_of(axes, [](const auto& axis) { return axis.has_value(); })) return;
  if (wish.*law.whole) throw Refusal("argument '" + law.name + "' does not go with its single axes");
  wish.*law.axes = {axes, 0};
}

void take_limit(const Arguments& arguments, const Limit& limit, JointOverride& wish) {
  const std::span<const double> given = arguments.numbers(limit.name, 2, std::numbers::pi);
  if (given.empty()) return;
  if (given[0] > 0.0 || given[1] < 0.0) {
    throw Refusal("argument '" + limit.name + "' is not a lower limit up to 0 and an upper one from 0 [rad]");
  }
  doll::AngleRange range{given[0], given[1]};
  if (limit.name != "limits.twist") range = {std::min(range.lower, -kLeastSwing), std::max(range.upper, kLeastSwing)};
  wish.*limit.range = {range, 0};
}

}  // namespace

const std::vector<std::string_view>& joint_argument_names() {
  static const std::vector<std::string> kNames = make_names();
  static const std::vector<std::string_view> kViews(kNames.begin(), kNames.end());
  return kViews;
}

std::optional<doll::JointOverride> joint_arguments(const Arguments& arguments) {
  const auto& names = joint_argument_names();
  if (std::ranges::none_of(names, [&](std::string_view name) { return arguments.has(name); })) return std::nullopt;
  JointOverride wish;
  for (const Law& law : laws()) take_law(arguments, law, wish);
  for (const Limit& limit : limits()) take_limit(arguments, limit, wish);
  return wish;
}

}  // namespace layfigure::app
