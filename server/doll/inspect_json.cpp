#include <Eigen/Eigenvalues>
#include <cmath>
#include <nlohmann/json.hpp>

#include "geometry.h"
#include "inspection.h"
#include "layfigure/doll/inspect.h"
#include "override_names.h"
#include "settings_numbers.h"

namespace layfigure::doll {
namespace {

using Json = nlohmann::ordered_json;

/// null: infinite.
Json to_json(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json to_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json to_json(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

Json to_json(const AngleRange& range) { return {to_json(range.lower), to_json(range.upper)}; }

Json to_json(const Section& section) {
  return {{"area", section.area},
          {"second_moments", to_json(section.second_moments)},
          {"outermost", to_json(section.outermost)},
          {"axes", to_json(section.axes)},
          {"span", section.span},
          {"estimated", section.estimated}};
}

Json to_json(const dynamics::JointLimits& limits) {
  if (!limits.any()) return {};
  return {{"twist", to_json(twist_range(limits))},
          {"swing_y", to_json(swing_range(limits, 0))},
          {"swing_z", to_json(swing_range(limits, 1))},
          {"axes", to_json(limits.axes)},
          {"reference", to_json(limits.reference)}};
}

Json locked_json(const dynamics::JointShape& shape) {
  Json names = Json::array();
  for (std::size_t k = 0; k < kAxisNames.size(); ++k) {
    if (shape.locked[k]) names.push_back(kAxisNames[k]);
  }
  return names;
}

Json reasons_json(const Reasons& why, bool is_root) {
  Json json{{"density", why.density.text}, {"shape", why.shape.text}, {"friction", why.friction.text}};
  if (is_root) return json;
  json["stiffness"] = why.stiffness.text;
  json["damping"] = why.damping.text;
  json["flow_damping"] = why.flow_damping.text;
  json["yield_torque"] = why.yield_torque.text;
  json["hardening"] = why.hardening.text;
  json["limits"] = {{"twist", why.twist.text}, {"swing_y", why.swing_y.text}, {"swing_z", why.swing_z.text}};
  json["locked"] = why.locked.text;
  return json;
}

Json body_json(const Doll& doll, std::size_t index) {
  const auto& body = doll.definition.bodies[index];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(body.inertia, Eigen::EigenvaluesOnly);
  Json json{{"name", body.name}};
  json["parent"] = body.parent < 0 ? Json() : Json(doll.definition.bodies[body.parent].name);
  json["mass"] = body.mass;
  json["density"] = doll.matter[index].density;
  json["com"] = to_json(body.com);
  json["inertia"] = to_json(Eigen::Vector3d(principal.eigenvalues()));
  json["section"] = to_json(doll.sections[index]);
  json["stiffness"] = to_json(body.joint.stiffness);
  json["damping"] = body.joint.damping;
  json["flow_damping"] = body.joint.flow_damping;
  json["yield_torque"] = to_json(body.joint.yield_torque);
  json["hardening"] = body.joint.hardening;
  json["axis_ratios"] = {{"stiffness", to_json(body.joint.shape.stiffness)},
                         {"damping", to_json(body.joint.shape.damping)},
                         {"yield_torque", to_json(body.joint.shape.yield)}};
  json["limits"] = to_json(body.limits);
  json["locked"] = locked_json(body.joint.shape);
  json["shape"] = kShapeNames[static_cast<int>(doll.matter[index].shape)];
  json["friction"] = doll.matter[index].friction;
  json["reasons"] = reasons_json(doll.reasons[index], body.parent < 0);
  return json;
}

Json merged_json(const Doll& doll) {
  Json merged = Json::array();
  for (std::size_t bone = 0; bone < doll.rig.bones.size(); ++bone) {
    if (doll.body_of_bone[bone] >= 0) continue;
    const int body = doll.carriers[bone].body;
    merged.push_back({{"bone", doll.rig.bones[bone].name},
                      {"body", body < 0 ? Json() : Json(doll.definition.bodies[body].name)},
                      {"reason", doll.body_reasons[bone].text}});
  }
  return merged;
}

Json settings_json(const DollSettings& settings) {
  Json json{{"source", settings.source.empty() ? Json() : Json(settings.source)}};
  json["material"] = settings.material;
  Json why{{"material", why_of_number(settings, "material")}};
  for (const SettingsNumber& number : numbers_of(settings)) {
    json[number.name] = number.value;
    why[number.name] = number.why;
  }
  json["total_mass"] = settings.total_mass ? Json(settings.total_mass->value) : Json();
  json["reasons"] = std::move(why);
  return json;
}

Json geometry_json(const Doll& doll) {
  const Geometry geometry = make_geometry(doll);
  Json json{{"vertices", Json::array()}, {"triangles", Json::array()}};
  for (const auto& vertex : geometry.surface.vertices) json["vertices"].push_back(to_json(vertex));
  for (const auto& t : geometry.surface.triangles) json["triangles"].push_back({t[0], t[1], t[2]});
  json["body_of_triangle"] = geometry.body_of_triangle;
  json["bodies"] = Json::array();
  for (const BodyGeometry& body : geometry.bodies) {
    Json semi_axes = Json::array();
    Json outline = Json::array();
    for (const auto& axis : body.semi_axes) semi_axes.push_back(to_json(axis));
    for (const auto& corner : body.section) outline.push_back(to_json(corner));
    json["bodies"].push_back({{"com", to_json(body.com)}, {"semi_axes", semi_axes}, {"section", outline}});
  }
  return json;
}

}  // namespace

std::string inspect_json(const Doll& doll, bool with_geometry) {
  Json json{{"name", doll.rig.name}, {"source_file", doll.rig.source_file}, {"content_hash", hash_text(doll)}};
  json["settings"] = settings_json(doll.settings);
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
  json["merged"] = merged_json(doll);
  json["warnings"] = doll.rig.warnings;
  for (const std::string& warning : doll.warnings) json["warnings"].push_back(warning);
  if (with_geometry) json["geometry"] = geometry_json(doll);
  const int indent = with_geometry ? -1 : 2;  // a line for each coordinate would be of no use
  return json.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace layfigure::doll
