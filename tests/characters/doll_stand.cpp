// doll_stand CHARACTER SECONDS HZ: makes a doll of a file, lets it stand as the server does, and prints what became of
// it as one JSON object; a file that cannot become a doll is {"refused": reason}.
#include <time.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "layfigure/app/simulation.h"
#include "layfigure/character/import.h"
#include "layfigure/doll/build.h"

namespace {

using namespace layfigure;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using Json = nlohmann::ordered_json;

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Json to_json(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// Angle by which the joint has turned since the beginning [rad]; a root: since it was pinned.
double turned(const dynamics::BodyDefinition& body, const dynamics::BodyState& state) {
  return body.rotation.angularDistance(state.rotation);
}

double fastest_joint(const doll::Doll& doll, dynamics::State state) {
  const dynamics::Model model(doll.definition);
  dynamics::Workspace workspace(model);
  std::vector<dynamics::BodyPose> poses;
  std::vector<dynamics::BodyVelocity> velocities;
  dynamics::world_poses(model, state, poses);
  dynamics::world_velocities(model, state, workspace, poses, velocities);
  double fastest = 0.0;
  for (int b = 0; b < model.size(); ++b) {
    const int parent = model.body(b).parent;
    const Vector3d relative = velocities[b].angular - (parent < 0 ? Vector3d::Zero() : velocities[parent].angular);
    fastest = std::max(fastest, relative.norm());
  }
  return fastest;
}

/// Where the bones are when their rotations are put on the skeleton, as a recorded animation does.
std::vector<Isometry3d> animated_bones(const doll::Doll& doll, const doll::SkeletonPose& pose) {
  std::vector<Isometry3d> result;
  for (std::size_t b = 0; b < doll.rig.bones.size(); ++b) {
    const character::Bone& bone = doll.rig.bones[b];
    Isometry3d local = Isometry3d::Identity();
    local.linear() = pose.rotations[b].toRotationMatrix();
    local.translation() = bone.parent < 0 ? pose.root_translation : Vector3d(bone.rest.translation());
    result.push_back(bone.parent < 0 ? local : result[bone.parent] * local);
  }
  return result;
}

/// Largest distance between a bone of the animation and where its body carries it [m]: the skeleton and the simulation
/// have the same bone lengths if it is rounding.
double bone_length_error(const doll::Doll& doll, const dynamics::State& state) {
  const dynamics::Model model(doll.definition);
  std::vector<dynamics::BodyPose> poses;
  dynamics::world_poses(model, state, poses);
  doll::SkeletonPose pose;
  doll::skeleton_pose(doll, state, pose);
  const std::vector<Isometry3d> bones = animated_bones(doll, pose);
  double largest = 0.0;
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const doll::Carrier& carrier = doll.carriers[b];
    if (carrier.body < 0) continue;
    const dynamics::BodyPose& body = poses[carrier.body];
    const Vector3d carried = body.origin + body.rotation * carrier.pose.translation();
    largest = std::max(largest, (bones[b].translation() - carried).norm());
  }
  return largest;
}

void add_character(const doll::Doll& doll, Json& result) {
  Eigen::AlignedBox3d box;
  std::size_t vertices = 0;
  for (const auto& mesh : doll.rig.meshes) {
    for (const auto& vertex : mesh.vertices) box.extend(vertex);
    vertices += mesh.vertices.size();
  }
  result["vertices"] = vertices;
  result["meshes"] = doll.rig.meshes.size();
  result["bones"] = doll.rig.bones.size();
  result["bodies"] = doll.definition.bodies.size();
  result["size"] = to_json(box.sizes());
  double mass = 0.0;
  for (const auto& body : doll.definition.bodies) mass += body.mass;
  result["mass"] = mass;
  result["import_warnings"] = doll.rig.warnings;
  result["warnings"] = doll.warnings;
}

void add_stand(doll::Doll doll, double seconds, double hz, Json& result) {
  app::SimulationSettings settings;
  settings.physics_hz = hz;
  app::Simulation simulation(std::move(doll), settings);
  const double start = cpu_seconds();
  bool finite = true;
  while (finite && static_cast<double>(simulation.steps()) < seconds * hz) finite = simulation.advance();
  result["cpu_seconds"] = cpu_seconds() - start;
  result["failure"] = simulation.failure();
  const dynamics::State& state = simulation.state();
  double sag = 0.0;
  int yielded = 0;
  std::string sagging;
  for (std::size_t b = 0; b < state.bodies.size(); ++b) {
    const dynamics::BodyDefinition& body = simulation.doll().definition.bodies[b];
    finite = finite && state.bodies[b].rotation.coeffs().allFinite() && state.bodies[b].position.allFinite();
    if (state.bodies[b].flow > 0.0) ++yielded;
    if (turned(body, state.bodies[b]) <= sag) continue;
    sag = turned(body, state.bodies[b]);
    sagging = body.name;
  }
  result["finite"] = finite;
  result["joint_speed"] = fastest_joint(simulation.doll(), state);
  result["sag"] = sag;
  result["sagging"] = sagging;
  result["yielded"] = yielded;
  result["bone_length_error"] = bone_length_error(simulation.doll(), state);
}

double number(const char* text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text, text + std::strlen(text), value);
  if (error != std::errc{} || *end != '\0' || !(value > 0.0)) {
    throw std::invalid_argument(std::string("'") + text + "' is not a number above 0");
  }
  return value;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: doll_stand CHARACTER SECONDS HZ\n";
    return 2;
  }
  Json result;
  try {
    const double seconds = number(argv[2]);
    const double hz = number(argv[3]);
    doll::Doll doll = doll::build_doll(character::import_rig(argv[1]));
    add_character(doll, result);
    add_stand(std::move(doll), seconds, hz, result);
  } catch (const character::ImportError& error) {
    result = {{"refused", error.what()}};
  } catch (const std::exception& error) {
    result = {{"refused", std::string("doll: ") + error.what()}};
  }
  std::cout << result.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}
