#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "angles.h"
#include "inspection.h"
#include "layfigure/doll/inspect.h"
#include "override_names.h"

namespace layfigure::doll {
namespace {

constexpr std::size_t kLongestName = 40;

[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...) {
  std::va_list arguments;
  va_start(arguments, pattern);
  char text[128];  // numbers only, which are short
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

/// What is told of one body.
struct Row {
  const Doll& doll;
  const dynamics::BodyDefinition& body;
  const Section& section;
  const Matter& matter;
  const Reasons& why;

  [[nodiscard]] bool is_root() const { return body.parent < 0; }
};

/// Behind a number: where it comes from. The legend is below the table.
char mark(const Reason& why) {
  switch (why.origin) {
    case Origin::kEstimate:
      return '*';
    case Origin::kRaised:
      return '+';
    case Origin::kFile:
      return '~';
    case Origin::kSettings:
      return '=';
    default:
      return ' ';
  }
}

std::string of_joint(const Row& row, double value, const Reason& why) {
  return row.is_root() ? "" : format("%.4g%c", value, mark(why));
}

/// Of twist, bend about y and about z; nothing where they are equal.
std::string of_axes(const Row& row, const Eigen::Vector3d& ratios) {
  const std::string text = format("%.3g:%.3g:%.3g", ratios[0], ratios[1], ratios[2]);
  return row.is_root() || text == "1:1:1" ? "" : text;
}

std::string degrees(double angle) { return std::isfinite(angle) ? format("%.4g", to_degrees(angle)) : "free"; }

std::string of_limits(const Row& row, const AngleRange& range, const Reason& why) {
  if (row.is_root()) return "";
  if (!std::isfinite(range.lower) && !std::isfinite(range.upper)) return "free ";
  return degrees(range.lower) + ".." + degrees(range.upper) + mark(why);
}

std::string locked_axes(const Row& row) {
  std::string list;
  for (std::size_t k = 0; k < kAxisNames.size(); ++k) {
    if (row.body.joint.shape.locked[k]) list.append(list.empty() ? "" : ",").append(kAxisNames[k]);
  }
  return list.empty() ? "" : list + mark(row.why.locked);
}

std::string parent_name(const Row& row) {
  return row.is_root() ? "-" : row.doll.definition.bodies[row.body.parent].name.substr(0, kLongestName);
}

struct Column {
  const char* title;
  const char* unit;
  std::string (*cell)(const Row&);
};

const std::array<Column, 19> kColumns{{
    {"body", "", [](const Row& r) { return r.body.name.substr(0, kLongestName); }},
    {"parent", "", parent_name},
    {"mass", "kg ", [](const Row& r) { return format("%.4f%c", r.body.mass, mark(r.why.density)); }},
    {"area", "cm^2 ",
     [](const Row& r) { return format("%.3f%c", r.section.area * 1e4, r.section.estimated ? '*' : ' '); }},
    {"I", "m^4", [](const Row& r) { return format("%.4g", 0.5 * r.section.second_moments.x()); }},
    {"s", "m", [](const Row& r) { return r.is_root() ? "" : format("%.4g", r.section.span); }},
    {"K_f", "N m/rad ", [](const Row& r) { return of_joint(r, r.body.joint.stiffness, r.why.stiffness); }},
    {"by axis", "t:y:z", [](const Row& r) { return of_axes(r, r.body.joint.shape.stiffness); }},
    {"D_f", "N m s/rad ", [](const Row& r) { return of_joint(r, r.body.joint.damping, r.why.damping); }},
    {"D_d", "N m s/rad ", [](const Row& r) { return of_joint(r, r.body.joint.flow_damping, r.why.flow_damping); }},
    {"yield", "N m ", [](const Row& r) { return of_joint(r, r.body.joint.yield_torque, r.why.yield_torque); }},
    {"by axis", "t:y:z", [](const Row& r) { return of_axes(r, r.body.joint.shape.yield); }},
    {"H", "N m/rad ", [](const Row& r) { return of_joint(r, r.body.joint.hardening, r.why.hardening); }},
    {"twist", "deg ", [](const Row& r) { return of_limits(r, twist_range(r.body.limits), r.why.twist); }},
    {"swing y", "deg ", [](const Row& r) { return of_limits(r, swing_range(r.body.limits, 0), r.why.swing_y); }},
    {"swing z", "deg ", [](const Row& r) { return of_limits(r, swing_range(r.body.limits, 1), r.why.swing_z); }},
    {"locked", "", locked_axes},
    {"shape", "",
     [](const Row& r) { return std::string(kShapeNames[static_cast<int>(r.matter.shape)]) + mark(r.why.shape); }},
    {"friction", "", [](const Row& r) { return format("%.3g%c", r.matter.friction, mark(r.why.friction)); }},
}};
constexpr std::size_t kNameColumns = 2;  // set to the left, numbers to the right

using Cells = std::array<std::string, kColumns.size()>;

std::vector<Cells> table_cells(const Doll& doll) {
  std::vector<Cells> table(2);
  for (std::size_t c = 0; c < kColumns.size(); ++c) {
    table[0][c] = kColumns[c].title;
    table[1][c] = kColumns[c].unit;
  }
  for (std::size_t b = 0; b < doll.definition.bodies.size(); ++b) {
    const Row row{doll, doll.definition.bodies[b], doll.sections[b], doll.matter[b], doll.reasons[b]};
    Cells& cells = table.emplace_back();
    for (std::size_t c = 0; c < kColumns.size(); ++c) cells[c] = kColumns[c].cell(row);
  }
  return table;
}

/// Columns as wide as their widest cell, two spaces apart; no spaces at the end of a line.
std::string table_text(const std::vector<Cells>& table) {
  std::array<std::size_t, kColumns.size()> width{};
  for (const Cells& cells : table) {
    for (std::size_t c = 0; c < cells.size(); ++c) width[c] = std::max(width[c], cells[c].size());
  }
  std::string text;
  for (const Cells& cells : table) {
    std::string line;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const std::string space(width[c] - cells[c].size(), ' ');
      line += (c == 0 ? "" : "  ") + (c < kNameColumns ? cells[c] + space : space + cells[c]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string merged_text(const Doll& doll) {
  std::string text;
  for (std::size_t bone = 0; bone < doll.rig.bones.size(); ++bone) {
    if (doll.body_of_bone[bone] >= 0) continue;
    const int body = doll.carriers[bone].body;
    text += doll.rig.bones[bone].name.substr(0, kLongestName);
    text += body < 0 ? " stays where it is: "
                     : " rides on " + doll.definition.bodies[body].name.substr(0, kLongestName) + ": ";
    text += doll.body_reasons[bone].text + "\n";
  }
  return text.empty() ? "" : "\n" + text;
}

std::string head_text(const Doll& doll) {
  std::string text = doll.rig.name + " (" + doll.rig.source_file + ", hash " + hash_text(doll) + ")\n";
  text += format("%zu bones, %zu bodies, %.3f kg\n", doll.rig.bones.size(), doll.definition.bodies.size(),
                 total_mass(doll));
  text += "settings: " + (doll.settings.source.empty() ? "default" : doll.settings.source) + "\n";
  return text + "material: " + doll.settings.material + "\n";
}

}  // namespace

std::string inspect_text(const Doll& doll) {
  std::string text = head_text(doll) + "\n" + table_text(table_cells(doll));
  text += "* from an estimated section   + raised to a minimum   ~ by the character's file   = by the settings\n";
  text += "by axis: multiples of the number before, of twist : bend about y : bend about z, where they differ\n";
  text += merged_text(doll);
  text += format("\nroot pin: %.4g N/m, %.4g N s/m, %.4g N m/rad, %.4g N m s/rad\n", doll.root_pin.stiffness,
                 doll.root_pin.damping, doll.root_pin.angular_stiffness, doll.root_pin.angular_damping);
  for (const std::string& warning : doll.rig.warnings) text += "warning: " + warning + "\n";
  for (const std::string& warning : doll.warnings) text += "warning: " + warning + "\n";
  return text;
}

}  // namespace layfigure::doll
