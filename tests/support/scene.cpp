#include "scene.h"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "cpu_clock.h"
#include "layfigure/math/rotation.h"

namespace layfigure::testing {
namespace {

using Json = nlohmann::json;

Eigen::Vector3d vector_of(const Json& json, const char* key) {
  const auto v = json.at(key).get<std::array<double, 3>>();
  return {v[0], v[1], v[2]};
}

dynamics::BodyDefinition body_of(const Json& json) {
  dynamics::BodyDefinition body;
  body.name = json.value("name", "");
  body.parent = json.at("parent").get<int>();
  body.anchor = vector_of(json, "anchor");
  body.com = vector_of(json, "com");
  body.mass = json.at("mass").get<double>();
  body.inertia = vector_of(json, "inertia").asDiagonal();
  const auto q = json.at("quat0").get<std::array<double, 4>>();
  body.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  body.joint.stiffness = json.at("K").get<double>();
  body.joint.damping = json.at("D").get<double>();
  // null, like nothing, is an elastic joint: JSON has no infinity.
  if (json.contains("yield_torque") && !json["yield_torque"].is_null()) {
    body.joint.yield_torque = json["yield_torque"].get<double>();
  }
  body.joint.flow_damping = json.value("flow_damping", 0.0);
  return body;
}

Pull pull_of(const Json& json, int bodies) {
  Pull pull;
  pull.body = json.at("index").get<int>();
  if (pull.body < 0 || pull.body >= bodies) throw std::runtime_error("load index out of range");
  pull.force = vector_of(json, "force");
  pull.start = json.at("start").get<double>();
  pull.end = json.at("end").get<double>();
  const auto shape = json.value("shape", "sin2");
  if (shape != "sin2" && shape != "constant") throw std::runtime_error("load shape '" + shape + "' is unknown");
  pull.shape = shape == "sin2" ? Pull::Shape::kSinSquared : Pull::Shape::kConstant;
  return pull;
}

Limb limb_of(const Json& json, int bodies) {
  Limb limb;
  limb.body = json.at("body").get<int>();
  if (limb.body < 0 || limb.body >= bodies) throw std::runtime_error("limb body out of range");
  limb.from = vector_of(json, "from");
  limb.to = vector_of(json, "to");
  limb.radius = json.at("radius").get<double>();
  if (!(limb.radius > 0.0)) throw std::runtime_error("limb radius is not > 0");
  return limb;
}

dynamics::RootKind root_of(const std::string& name) {
  if (name == "ball") return dynamics::RootKind::kBall;
  if (name == "free") return dynamics::RootKind::kFree;
  throw std::runtime_error("root '" + name + "' is unknown");
}

/// The file gives world orientations; a joint's rotation is relative to the parent's.
void make_relative(std::vector<dynamics::BodyDefinition>& bodies) {
  std::vector<Eigen::Quaterniond> world;
  for (auto& body : bodies) {
    world.push_back(body.rotation);
    if (body.parent >= static_cast<int>(world.size()) - 1) throw std::runtime_error("parent after its child");
    if (body.parent >= 0) body.rotation = world[body.parent].conjugate() * body.rotation;
  }
}

Scene scene_of(const Json& json) {
  Scene scene;
  scene.name = json.at("name").get<std::string>();
  scene.duration = json.value("duration", 1.0);
  if (!(scene.duration > 0.0)) throw std::runtime_error("duration is not > 0");
  scene.definition.gravity = vector_of(json, "gravity");
  const auto law = json.value("law", "paper");
  if (law != "paper" && law != "overstress") throw std::runtime_error("law '" + law + "' is unknown");
  scene.definition.law = law == "paper" ? dynamics::FlowLaw::kPaper : dynamics::FlowLaw::kOverstress;
  for (const Json& body : json.at("bodies")) scene.definition.bodies.push_back(body_of(body));
  make_relative(scene.definition.bodies);
  const int bodies = static_cast<int>(scene.definition.bodies.size());
  for (const Json& load : json.value("loads", Json::array())) scene.pulls.push_back(pull_of(load, bodies));
  scene.definition.root = root_of(json.value("root", "ball"));
  for (const Json& limb : json.value("limbs", Json::array())) scene.limbs.push_back(limb_of(limb, bodies));
  if (json.contains("floor") && !json["floor"].is_null()) scene.floor = json["floor"].get<double>();
  return scene;
}

}  // namespace

void Pulls::add(double time, std::span<dynamics::BodyForce> forces) const {
  for (const Pull& pull : pulls_) {
    if (time < pull.start || time > pull.end) continue;
    const double s = std::sin(std::numbers::pi * (time - pull.start) / (pull.end - pull.start));
    forces[pull.body].force += pull.shape == Pull::Shape::kSinSquared ? (s * s * pull.force).eval() : pull.force;
  }
}

Scene load_scene(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  try {
    return scene_of(Json::parse(file));
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

Scene chain(const ChainOptions& options) {
  Scene scene;
  scene.name = "chain-" + std::to_string(options.links);
  scene.definition.law = options.law;
  for (int i = 0; i < options.links; ++i) {
    dynamics::BodyDefinition body;
    body.name = "link" + std::to_string(i);
    body.parent = i - 1;
    body.anchor = {i == 0 ? 0.0 : 0.1, 0.0, 0.0};
    body.com = {0.05, 0.0, 0.0};
    body.mass = 0.1;
    body.inertia = Eigen::Vector3d(2e-5, 28e-5 / 3, 28e-5 / 3).asDiagonal();
    const double turn = 0.7 * i;
    body.rotation = math::exp_rotation(options.bend * Eigen::Vector3d(0.3, std::cos(turn), std::sin(turn)));
    body.joint = {.stiffness = options.stiffness,
                  .damping = options.damping,
                  .flow_damping = options.flow_damping,
                  .yield_torque = options.yield_torque};
    scene.definition.bodies.push_back(body);
  }
  return scene;
}

Scene pulled_chain(const ChainOptions& options) {
  Scene scene = chain(options);
  scene.name += "-pulled";
  scene.definition.gravity.setZero();
  scene.pulls.push_back({.body = options.links - 1, .force = {0.3, 1.0, 0.6}, .start = 0.0, .end = 0.5});
  return scene;
}

RunResult run_scene(const Scene& scene, const dynamics::Model& model, int steps, int order) {
  RunResult result{.state = dynamics::initial_state(model), .coms = {}};
  dynamics::Workspace workspace(model);
  const Pulls pulls(scene.pulls);
  const dynamics::Inputs inputs{.loads = pulls.empty() ? nullptr : &pulls, .couplings = {}};
  const dynamics::StepOptions options{.step = scene.duration / steps, .order = order};
  const double start = thread_cpu_seconds();
  for (int k = 0; k < steps && result.finite; ++k) {
    // The step count gives the time, so that loads do not drift with rounding.
    result.state.time = scene.duration * k / steps;
    const auto report = dynamics::step(model, result.state, workspace, inputs, options);
    result.solves += report.solves;
    result.converged = result.converged && report.converged;
    result.finite = report.status == dynamics::StepStatus::kOk;
  }
  result.cpu_seconds = thread_cpu_seconds() - start;
  std::vector<dynamics::BodyPose> poses;
  dynamics::world_poses(model, result.state, poses);
  for (const auto& pose : poses) result.coms.push_back(pose.com);
  return result;
}

double rms_distance(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.size()));
}

}  // namespace layfigure::testing
