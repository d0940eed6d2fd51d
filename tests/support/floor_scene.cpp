#include "floor_scene.h"

#include "layfigure/scene/scene.h"

namespace layfigure::testing {
namespace {

// Of all limbs: they never meet each other.
constexpr int kGroup = 1;

collision::ShapeDefinition shape_of(const Limb& limb, double friction) {
  collision::ShapeDefinition shape;
  shape.name = "limb of body " + std::to_string(limb.body);
  shape.shape = collision::Capsule{.radius = limb.radius, .half_length = 0.5 * (limb.to - limb.from).norm()};
  shape.body = limb.body;
  shape.X_BS.rotation = limb_rotation(limb);
  shape.X_BS.position = 0.5 * (limb.from + limb.to);
  shape.friction = friction;
  shape.group = kGroup;
  return shape;
}

scene::SceneDefinition definition_of(const Scene& scene) {
  scene::SceneDefinition definition{.model = scene.definition, .shapes = {}, .excluded = {}};
  collision::ShapeDefinition& floor = definition.shapes.emplace_back();
  floor.name = "floor";
  floor.shape = collision::Plane{};
  floor.friction = *scene.floor;
  for (const Limb& limb : scene.limbs) definition.shapes.push_back(shape_of(limb, *scene.floor));
  return definition;
}

double support(const scene::Scene& scene) {
  double sum = 0.0;
  for (std::size_t k = 0; k < scene.contacts().size(); ++k) sum += scene.contact_force(static_cast<int>(k)).z();
  return sum;
}

}  // namespace

Eigen::Quaterniond limb_rotation(const Limb& limb) {
  const Eigen::Vector3d axis = limb.to - limb.from;
  if (axis.isZero(0.0)) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis);
}

double penetration(const Scene& scene, const std::vector<dynamics::BodyPose>& poses) {
  double deepest = 0.0;
  for (const Limb& limb : scene.limbs) {
    const dynamics::BodyPose& pose = poses[limb.body];
    for (const Eigen::Vector3d& end : {limb.from, limb.to}) {
      deepest = std::max(deepest, limb.radius - (pose.origin + pose.rotation * end).z());
    }
  }
  return deepest;
}

FloorRun run_on_floor(const Scene& scene, int steps, int order) {
  scene::Scene stepped(definition_of(scene));
  FloorRun run{.result = {.state = dynamics::initial_state(stepped.model()), .coms = {}}, .touch = {}};
  RunResult& result = run.result;
  const Pulls pulls(scene.pulls);
  const dynamics::Inputs inputs{.loads = pulls.empty() ? nullptr : &pulls};
  const dynamics::StepOptions options{.step = scene.duration / steps, .order = order};
  std::vector<dynamics::BodyPose> poses;
  const WatchedSteps watched = watch_steps(
      scene, steps,
      [&](int k) {
        result.state.time = scene.duration * k / steps;
        const scene::SceneReport report = stepped.step(result.state, inputs, options);
        result.solves += report.step.solves;
        result.converged = result.converged && report.step.converged;
        result.finite = result.finite && report.step.status == dynamics::StepStatus::kOk;
      },
      [&]() -> const std::vector<dynamics::BodyPose>& {
        world_poses(stepped.model(), result.state, poses);
        return poses;
      });
  result.cpu_seconds = watched.cpu_seconds;
  for (const dynamics::BodyPose& pose : poses) result.coms.push_back(pose.com);
  run.touch = {.penetration = watched.penetration,
               .kinetic = energy(stepped.model(), result.state).kinetic,
               .support = support(stepped)};
  return run;
}

}  // namespace layfigure::testing
