#include "layfigure/doll/write_settings.h"

#include <algorithm>
#include <fstream>
#include <optional>

#include "angles.h"
#include "axis_values.h"
#include "inspection.h"
#include "override_names.h"
#include "settings_numbers.h"
#include "toml_text.h"

namespace layfigure::doll {
namespace {

constexpr std::size_t kCommentColumn = 40;
constexpr double kMostDegrees = 180.0;

/// `key = value   # comment`, the comments below each other where the values are short.
std::string line(const std::string& key, const std::string& value, const std::string& comment) {
  std::string text = key + " = " + value;
  text.resize(std::max(text.size() + 1, kCommentColumn), ' ');
  return text + "# " + toml_comment(comment) + "\n";
}

std::string amount(const std::string& key, double value, const char* unit, const Reason& why) {
  return line(key, toml_number(value), std::string(unit) + why.text);
}

/// The values of the three axes where they differ.
std::string amounts(const std::string& key, double unit, const Eigen::Vector3d& ratios, const char* unit_name,
                    const Reason& why) {
  const auto values = exact_axis_values(unit, ratios);
  if (!values || ratios == Eigen::Vector3d::Ones()) return amount(key, unit, unit_name, why);
  std::string table;
  for (std::size_t k = 0; k < kAxisNames.size(); ++k) {
    table.append(k == 0 ? "{" : ", ").append(kAxisNames[k]).append(" = ").append(toml_number((*values)[k]));
  }
  return line(key, table + "}", std::string(unit_name) + why.text);
}

/// A range in degrees that reads back as the same radians, if there is one: a limit that was widened to hold the rest
/// pose may be beyond the half turn that a file can say.
std::optional<std::string> range_text(const AngleRange& range) {
  const std::optional<double> lower = exact_degrees(range.lower);
  const std::optional<double> upper = exact_degrees(range.upper);
  if (!lower || !upper || std::max(-*lower, *upper) > kMostDegrees) return std::nullopt;
  return std::string("[").append(toml_number(*lower)).append(", ").append(toml_number(*upper)).append("]");
}

/// A range that no double in degrees gives exactly is told in a comment only: left out, it is chosen as it was.
std::string limit(const std::string& axis, const AngleRange& range, const Reason& why) {
  if (const auto text = range_text(range)) return line("limits." + axis, *text, "deg, " + why.text);
  return "# limits." + axis + " is " + toml_number(to_degrees(range.lower)) + " to " +
         toml_number(to_degrees(range.upper)) + " deg, " + toml_comment(why.text) + "\n";
}

std::string locked(const dynamics::JointShape& shape, const Reason& why) {
  std::string list;
  for (std::size_t k = 0; k < kAxisNames.size(); ++k) {
    if (shape.locked[k]) list.append(list.empty() ? "\"" : ", \"").append(kAxisNames[k]).append("\"");
  }
  return line("locked", "[" + list + "]", why.text);
}

std::string joint_text(const dynamics::BodyDefinition& body, const Reasons& why) {
  std::string text;
  const dynamics::JointLaw& law = body.joint;
  text += amounts("stiffness", law.stiffness, law.shape.stiffness, "N m/rad, ", why.stiffness);
  text += amounts("damping", law.damping, law.shape.damping, "N m s/rad, ", why.damping);
  text += amount("flow_damping", law.flow_damping, "N m s/rad, ", why.flow_damping);
  text += amounts("yield_torque", law.yield_torque, law.shape.yield, "N m, ", why.yield_torque);
  text += amount("hardening", law.hardening, "N m/rad, ", why.hardening);
  text += limit("twist", twist_range(body.limits), why.twist);
  text += limit("swing_y", swing_range(body.limits, 0), why.swing_y);
  text += limit("swing_z", swing_range(body.limits, 1), why.swing_z);
  return text + locked(body.joint.shape, why.locked);
}

std::string body_text(const Doll& doll, int index) {
  const dynamics::BodyDefinition& body = doll.definition.bodies[index];
  const Matter& matter = doll.matter[index];
  const Reasons& why = doll.reasons[index];
  std::string text;
  text += line("density", toml_number(matter.density),
               "kg/m^3, " + why.density.text + "; makes " + short_number(body.mass) + " kg");
  const std::string shape(kShapeNames[static_cast<int>(matter.shape)]);
  text += line("shape", "\"" + shape + "\"", why.shape.text);
  text += line("friction", toml_number(matter.friction), why.friction.text);
  return body.parent < 0 ? text + "# the doll's root, which has no joint\n" : text + joint_text(body, why);
}

/// What the rules chose is told in a comment: they choose more than merge can say (whose body a bone rides on).
std::string merge_text(const Doll& doll, std::size_t bone) {
  const Reason& why = doll.body_reasons[bone];
  const std::string text = line("merge", doll.body_of_bone[bone] < 0 ? "true" : "false", why.text);
  return why.origin == Origin::kSettings ? text : "# " + text;
}

std::string bone_text(const Doll& doll, std::size_t bone) {
  const int body = doll.body_of_bone[bone];
  const std::string text = "\n[joints." + toml_key(doll.rig.bones[bone].name) + "]\n" + merge_text(doll, bone);
  return body < 0 ? text : text + body_text(doll, body);
}

std::string head_text(const Doll& doll) {
  const std::string name = toml_comment("'" + doll.rig.name + "' (" + doll.rig.source_file);
  const std::string source = doll.settings.source.empty() ? "the default settings" : doll.settings.source;
  std::string text = "# The doll of " + name + ", hash " + hash_text(doll) + "), " + short_number(total_mass(doll)) +
                     " kg, built by " + toml_comment(source) + ".\n";
  text += "# Every value is that of the doll, and behind it is why. What is taken out is chosen anew.\n\n";
  return text;
}

std::string numbers_text(const DollSettings& settings) {
  std::string text = line("material", "\"" + settings.material + "\"", why_of_number(settings, "material"));
  for (const SettingsNumber& number : numbers_of(settings)) {
    text += line(number.name, toml_number(number.value), number.why);
  }
  if (!settings.total_mass) return text;
  return text + "# total_mass = " + toml_number(settings.total_mass->value) + " is in the densities of the bodies\n";
}

void write_whole(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::path partial = path;
  partial += ".partial";
  std::ofstream file(partial, std::ios::binary);
  file << text;
  file.close();
  std::error_code error;
  if (file) std::filesystem::rename(partial, path, error);
  if (file && !error) return;
  std::filesystem::remove(partial, error);
  throw SettingsError(path.string() + ": cannot be written; check the folder and its permissions");
}

}  // namespace

std::string settings_text(const Doll& doll) {
  std::string text = head_text(doll) + numbers_text(doll.settings);
  for (std::size_t bone = 0; bone < doll.rig.bones.size(); ++bone) text += bone_text(doll, bone);
  return text;
}

void write_settings(const Doll& doll, const std::filesystem::path& path, bool may_replace) {
  if (std::filesystem::is_directory(path)) throw SettingsError(path.string() + ": a folder, expected a file to write");
  if (!may_replace && std::filesystem::exists(std::filesystem::symlink_status(path))) {
    throw SettingsError(path.string() + ": there is such a file already; --force replaces it");
  }
  write_whole(path, settings_text(doll));
}

}  // namespace layfigure::doll
