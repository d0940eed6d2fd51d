#include "layfigure/doll/inspect.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace layfigure::doll {
namespace {

using Json = nlohmann::ordered_json;

double total_mass(const Doll& doll) {
  double mass = 0.0;
  for (const auto& body : doll.definition.bodies) mass += body.mass;
  return mass;
}

[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...) {
  std::va_list arguments;
  va_start(arguments, pattern);
  char line[512];  // names are cut to 40 characters, numbers are short
  std::vsnprintf(line, sizeof line, pattern, arguments);
  va_end(arguments);
  return line;
}

std::string hash_text(const Doll& doll) {
  return format("%016llx", static_cast<unsigned long long>(doll.rig.content_hash));
}

/// Width of the columns of names.
int name_width(const Doll& doll) {
  std::size_t width = 6;  // "parent"
  for (const auto& body : doll.definition.bodies) width = std::max(width, body.name.size());
  return static_cast<int>(std::min<std::size_t>(width, 40));
}

std::string row(const Doll& doll, std::size_t index, int width) {
  const auto& body = doll.definition.bodies[index];
  const Section& section = doll.sections[index];
  std::string text = format("%-*.*s %-*.*s %9.4f %9.3f%c", width, width, body.name.c_str(), width, width,
                            body.parent < 0 ? "-" : doll.definition.bodies[body.parent].name.c_str(), body.mass,
                            section.area * 1e4, section.estimated ? '*' : ' ');
  text += format(" %11.4g", 0.5 * section.second_moments.x());
  if (body.parent < 0) return text + "   free root\n";
  return text + format(" %9.4g %9.4g %9.4g %9.4g %9.4g\n", section.span, body.joint.stiffness, body.joint.damping,
                       body.joint.flow_damping, body.joint.yield_torque);
}

Json to_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json to_json(const Section& section) {
  return {{"area", section.area},
          {"second_moments", to_json(section.second_moments)},
          {"outermost", to_json(section.outermost)},
          {"axes", {section.axes.w(), section.axes.x(), section.axes.y(), section.axes.z()}},
          {"span", section.span},
          {"estimated", section.estimated}};
}

Json body_json(const Doll& doll, std::size_t index) {
  const auto& body = doll.definition.bodies[index];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(body.inertia, Eigen::EigenvaluesOnly);
  Json json{{"name", body.name}};
  json["parent"] = body.parent < 0 ? Json() : Json(doll.definition.bodies[body.parent].name);
  json["mass"] = body.mass;
  json["com"] = to_json(body.com);
  json["inertia"] = to_json(Eigen::Vector3d(principal.eigenvalues()));
  json["section"] = to_json(doll.sections[index]);
  json["stiffness"] = body.joint.stiffness;
  json["damping"] = body.joint.damping;
  json["flow_damping"] = body.joint.flow_damping;
  json["yield_torque"] = std::isfinite(body.joint.yield_torque) ? Json(body.joint.yield_torque) : Json();
  json["hardening"] = body.joint.hardening;
  json["axis_ratios"] = {{"stiffness", to_json(body.joint.shape.stiffness)},
                         {"damping", to_json(body.joint.shape.damping)},
                         {"yield_torque", to_json(body.joint.shape.yield)}};
  return json;
}

}  // namespace

std::string inspect_text(const Doll& doll) {
  const int width = name_width(doll);
  std::string text = doll.rig.name + " (" + doll.rig.source_file + ", hash " + hash_text(doll) + ")\n";
  text += format("%zu bones, %zu bodies, %.3f kg\n\n", doll.rig.bones.size(), doll.definition.bodies.size(),
                 total_mass(doll));
  text += format("%-*s %-*s %9s %9s  %11s %9s %9s %9s %9s %9s\n", width, "body", width, "parent", "mass", "area", "I",
                 "s", "K_f", "D_f", "D_d", "yield");
  text += format("%-*s %-*s %9s %9s  %11s %9s %9s %9s %9s %9s\n", width, "", width, "", "kg", "cm^2", "m^4", "m",
                 "N m/rad", "N m s/rad", "N m s/rad", "N m");
  bool estimated = false;
  for (std::size_t index = 0; index < doll.definition.bodies.size(); ++index) {
    text += row(doll, index, width);
    estimated = estimated || doll.sections[index].estimated;
  }
  if (estimated) text += "* section estimated from the body's volume and length\n";
  text += format("\nroot pin: %.4g N/m, %.4g N s/m, %.4g N m/rad, %.4g N m s/rad\n", doll.root_pin.stiffness,
                 doll.root_pin.damping, doll.root_pin.angular_stiffness, doll.root_pin.angular_damping);
  for (const std::string& warning : doll.rig.warnings) text += "warning: " + warning + "\n";
  for (const std::string& warning : doll.warnings) text += "warning: " + warning + "\n";
  return text;
}

std::string inspect_json(const Doll& doll) {
  Json json{{"name", doll.rig.name}, {"source_file", doll.rig.source_file}, {"content_hash", hash_text(doll)}};
  json["bones"] = doll.rig.bones.size();
  json["mass"] = total_mass(doll);
  json["root_pin"] = {{"stiffness", doll.root_pin.stiffness},
                      {"damping", doll.root_pin.damping},
                      {"angular_stiffness", doll.root_pin.angular_stiffness},
                      {"angular_damping", doll.root_pin.angular_damping}};
  json["bodies"] = Json::array();
  for (std::size_t index = 0; index < doll.definition.bodies.size(); ++index) {
    json["bodies"].push_back(body_json(doll, index));
  }
  json["warnings"] = doll.rig.warnings;
  for (const std::string& warning : doll.warnings) json["warnings"].push_back(warning);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace layfigure::doll
