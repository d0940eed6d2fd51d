#include "layfigure/doll/settings.h"

#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include <toml++/toml.h>

#include "joint_tables.h"
#include "settings_numbers.h"
#include "toml_text.h"
#include "value_range.h"

namespace layfigure::doll {
namespace {

struct Field {
  std::string_view name;
  double DollSettings::*value;
  double least;
  double most;
  bool least_allowed;
  double Material::*of_material{nullptr};  ///< nullptr: no matter of material
};

constexpr std::array<Field, 12> kFields{{
    {"density", &DollSettings::density, 0.0, 1e6, false, &Material::density},
    {"elastic_modulus", &DollSettings::elastic_modulus, 0.0, kMostOfAny, true, &Material::elastic_modulus},
    {"poisson_ratio", &DollSettings::poisson_ratio, -1.0, 0.5, false, &Material::poisson_ratio},
    {"viscosity", &DollSettings::viscosity, 0.0, kMostOfAny, true, &Material::viscosity},
    {"flow_viscosity", &DollSettings::flow_viscosity, 0.0, kMostOfAny, true, &Material::flow_viscosity},
    {"yield_stress", &DollSettings::yield_stress, 0.0, kMostOfAny, true, &Material::yield_stress},
    {"hardening", &DollSettings::hardening, 0.0, kMostOfAny, true, &Material::hardening},
    {"largest_sag", &DollSettings::largest_sag, 0.0, 1.0, false},
    {"largest_strain", &DollSettings::largest_strain, 0.0, std::numbers::pi, false},
    {"hold_margin", &DollSettings::hold_margin, 1.0, 1e6, true},
    {"damping_ratio", &DollSettings::damping_ratio, 0.0, 10.0, true},
    {"largest_flow_rate", &DollSettings::largest_flow_rate, 0.0, 1e6, false},
}};

std::string unknown_material(std::string_view name) {
  std::string known;
  for (const Material& material : materials()) {
    known.append(known.empty() ? "\"" : ", \"").append(material.name).append("\"");
  }
  return "material = \"" + std::string(name) + "\", expected one of " + known;
}
constexpr ValueRange kTotalMasses{0.0, 1e6, false};

/// "" if the value is allowed, else one line.
std::string complaint(const Field& field, double value) {
  return range_complaint(field.name, value, {field.least, field.most, field.least_allowed});
}

int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

double read_number(const std::string& file, std::string_view key, const toml::node& node) {
  if (!node.is_number()) refuse(file, node.source(), std::string(key) + ": expected a number");
  return *node.value<double>();
}

/// What the numbers that the file does not give default to.
DollSettings base_settings(const std::string& file, const toml::table& table) {
  const toml::node* node = table.get("material");
  if (node == nullptr) return DollSettings{};
  const auto name = node->value_exact<std::string_view>();
  if (!name) refuse(file, node->source(), "material: expected a name in quotes");
  const Material* material = find_material(*name);
  if (material == nullptr) refuse(file, node->source(), unknown_material(toml_comment(*name)));
  DollSettings settings = settings_of(*material);
  settings.lines["material"] = line_of(*node);
  return settings;
}

OptionalEntry<double> read_total_mass(const std::string& file, const toml::node& node) {
  const double value = read_number(file, "total_mass", node);
  const std::string why = range_complaint("total_mass", value, kTotalMasses);
  if (!why.empty()) refuse(file, node.source(), why);
  return Entry<double>{value, line_of(node)};
}

void read_field(const std::string& file, std::string_view key, const toml::node& node, DollSettings& settings) {
  for (const Field& field : kFields) {
    if (key != field.name) continue;
    const double value = read_number(file, key, node);
    if (const std::string why = complaint(field, value); !why.empty()) refuse(file, node.source(), why);
    settings.*field.value = value;
    settings.lines[std::string(key)] = line_of(node);
    return;
  }
  std::string known = "material, ";
  for (const Field& field : kFields) known.append(field.name).append(", ");
  refuse(file, node.source(),
         "unknown key '" + toml_comment(key) + "', expected one of " + known + "total_mass, joints");
}

/// All but the material, which comes first.
void read_key(std::string_view key, const toml::node& node, DollSettings& settings) {
  if (key == "joints") {
    settings.joints = read_joint_tables(settings.source, node);
  } else if (key == "total_mass") {
    settings.total_mass = read_total_mass(settings.source, node);
  } else if (key != "material") {
    read_field(settings.source, key, node, settings);
  }
}

}  // namespace

DollSettings settings_of(const Material& material) {
  DollSettings settings;
  settings.material = material.name;
  settings.density = material.density;
  settings.elastic_modulus = material.elastic_modulus;
  settings.poisson_ratio = material.poisson_ratio;
  settings.viscosity = material.viscosity;
  settings.flow_viscosity = material.flow_viscosity;
  settings.yield_stress = material.yield_stress;
  settings.hardening = material.hardening;
  return settings;
}

void validate(const DollSettings& settings) {
  if (find_material(settings.material) == nullptr) {
    throw std::invalid_argument("doll settings: " + unknown_material(settings.material));
  }
  for (const Field& field : kFields) {
    if (const std::string why = complaint(field, settings.*field.value); !why.empty()) {
      throw std::invalid_argument("doll settings: " + why);
    }
  }
  if (!settings.total_mass) return;
  const std::string why = range_complaint("total_mass", settings.total_mass->value, kTotalMasses);
  if (!why.empty()) throw std::invalid_argument("doll settings: " + why);
}

std::vector<SettingsNumber> numbers_of(const DollSettings& settings) {
  std::vector<SettingsNumber> numbers;
  for (const Field& field : kFields) {
    const std::string name(field.name);
    numbers.push_back({name, settings.*field.value, why_of_number(settings, name)});
  }
  return numbers;
}

std::string why_of_number(const DollSettings& settings, const std::string& name) {
  if (const auto line = settings.lines.find(name); line != settings.lines.end()) {
    return "line " + std::to_string(line->second) + " of the settings";
  }
  const Material* material = find_material(settings.material);
  for (const Field& field : kFields) {
    if (name != field.name || field.of_material == nullptr || material == nullptr) continue;
    return settings.*field.value == material->*field.of_material ? "material " + settings.material : "given";
  }
  return "default";
}

std::filesystem::path settings_path_beside(const std::filesystem::path& character) {
  return std::filesystem::path(character).replace_extension(".doll.toml");
}

DollSettings load_settings(const std::filesystem::path& path) {
  DollSettings settings;
  settings.source = path.string();
  if (std::filesystem::is_directory(path))
    throw SettingsError(settings.source + ": a folder, expected a settings file");
  if (!std::filesystem::is_regular_file(path)) {
    throw SettingsError(settings.source + ": there is no such settings file; check the path");
  }
  try {
    const toml::table table = toml::parse_file(settings.source);
    settings = base_settings(settings.source, table);
    settings.source = path.string();
    for (const auto& [key, node] : table) read_key(key.str(), node, settings);
  } catch (const toml::parse_error& error) {
    refuse(settings.source, error.source(), "not TOML: " + std::string(error.description()));
  }
  return settings;
}

}  // namespace layfigure::doll
