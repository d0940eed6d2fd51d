#include "layfigure/doll/settings.h"

#include <array>
#include <cmath>
#include <numbers>
#include <sstream>
#include <string_view>

#include <toml++/toml.h>

namespace layfigure::doll {
namespace {

struct Field {
  std::string_view name;
  double DollSettings::*value;
  double least;
  double most;
  bool least_allowed;
};

constexpr double kMost = 1e12;  // above any material's; keeps products of fields finite

constexpr std::array<Field, 12> kFields{{
    {"density", &DollSettings::density, 0.0, 1e6, false},
    {"elastic_modulus", &DollSettings::elastic_modulus, 0.0, kMost, true},
    {"poisson_ratio", &DollSettings::poisson_ratio, -1.0, 0.5, false},
    {"viscosity", &DollSettings::viscosity, 0.0, kMost, true},
    {"flow_viscosity", &DollSettings::flow_viscosity, 0.0, kMost, true},
    {"yield_stress", &DollSettings::yield_stress, 0.0, kMost, true},
    {"hardening", &DollSettings::hardening, 0.0, kMost, true},
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

/// "" if the value is allowed, else one line.
std::string complaint(const Field& field, double value) {
  const bool enough = field.least_allowed ? value >= field.least : value > field.least;
  if (enough && value <= field.most) return {};
  std::ostringstream text;
  text << field.name << " = " << value << ", expected " << (field.least_allowed ? '[' : '(') << field.least << ", "
       << field.most << ']';
  return text.str();
}

[[noreturn]] void refuse(const std::filesystem::path& path, const toml::source_region& where, const std::string& why) {
  throw SettingsError(path.string() + ":" + std::to_string(where.begin.line) + ": " + why);
}

/// What the numbers that the file does not give default to.
DollSettings base_settings(const std::filesystem::path& path, const toml::table& table) {
  const toml::node* node = table.get("material");
  if (node == nullptr) return DollSettings{};
  const auto name = node->value_exact<std::string_view>();
  if (!name) refuse(path, node->source(), "material: expected a name in quotes");
  const Material* material = find_material(*name);
  if (material == nullptr) refuse(path, node->source(), unknown_material(*name));
  return settings_of(*material);
}

void read_field(const std::filesystem::path& path, std::string_view key, const toml::node& node,
                DollSettings& settings) {
  for (const Field& field : kFields) {
    if (key != field.name) continue;
    if (!node.is_number()) refuse(path, node.source(), std::string(key) + ": expected a number");
    const double value = *node.value<double>();
    if (const std::string why = complaint(field, value); !why.empty()) refuse(path, node.source(), why);
    settings.*field.value = value;
    return;
  }
  std::string known = "material";
  for (const Field& field : kFields) known.append(", ").append(field.name);
  refuse(path, node.source(), "unknown key '" + std::string(key) + "', expected one of " + known);
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
}

DollSettings load_settings(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    throw SettingsError(path.string() + ": there is no such settings file; check the path");
  }
  DollSettings settings;
  try {
    const toml::table table = toml::parse_file(path.string());
    settings = base_settings(path, table);
    for (const auto& [key, node] : table) {
      if (key != "material") read_field(path, key.str(), node, settings);
    }
  } catch (const toml::parse_error& error) {
    refuse(path, error.source(), "not TOML: " + std::string(error.description()));
  }
  return settings;
}

}  // namespace layfigure::doll
