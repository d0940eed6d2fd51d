#include "layfigure/scene/scene.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace layfigure::scene {
namespace {

using dynamics::BodyPose;

/// Radius of each body's shapes about its com [m]; 0: none.
std::vector<double> radii(const SceneDefinition& definition) {
  std::vector<double> radii(definition.model.bodies.size(), 0.0);
  for (const collision::ShapeDefinition& shape : definition.shapes) {
    if (shape.body < 0 || shape.body >= static_cast<int>(radii.size())) continue;
    const Eigen::Vector3d& com = definition.model.bodies[shape.body].com;
    const double radius = (shape.X_BS.position - com).norm() + collision::radius_of(shape.shape);
    radii[shape.body] = std::max(radii[shape.body], radius);
  }
  return radii;
}

collision::WorldDefinition world_definition(const SceneDefinition& definition) {
  collision::WorldDefinition world;
  world.bodies = static_cast<int>(definition.model.bodies.size());
  world.shapes = definition.shapes;
  world.excluded = definition.excluded;
  for (int i = 0; i < world.bodies; ++i) {
    const int parent = definition.model.bodies[i].parent;
    if (parent >= 0) world.excluded.emplace_back(parent, i);
  }
  return world;
}

Eigen::Vector3d in_body(const std::vector<BodyPose>& poses, int body, const Eigen::Vector3d& point) {
  if (body == collision::kWorldBody) return point;
  return poses[body].rotation.conjugate() * (point - poses[body].origin);
}

/// One name from the two shapes and the feature; that two points may share one only costs iterations.
std::uint64_t key_of(const collision::ContactPoint& point) {
  std::uint64_t key = point.feature;
  for (const int shape : {point.shape_a, point.shape_b}) {
    key = (key ^ static_cast<std::uint64_t>(shape)) * 0x9e3779b97f4a7c15ULL + (key >> 31);
  }
  return key;
}

dynamics::Contact contact_of(const collision::ContactPoint& point, const std::vector<BodyPose>& poses) {
  dynamics::Contact contact;
  contact.body_a = point.body_a;
  contact.body_b = point.body_b == collision::kWorldBody ? dynamics::kWorld : point.body_b;
  contact.point_a = in_body(poses, point.body_a, point.p_Wa);
  contact.point_b = in_body(poses, point.body_b, point.p_Wb);
  contact.normal = point.normal_W;
  contact.friction = point.friction;
  contact.key = key_of(point);
  return contact;
}

}  // namespace

struct Scene::Data {
  explicit Data(SceneDefinition definition)
      : radii(scene::radii(definition)),
        world(world_definition(definition)),
        model(std::move(definition.model)),
        workspace(model) {}

  void move(dynamics::State& state, double h);
  void collect_contacts();

  std::vector<double> radii;
  collision::World world;
  dynamics::Model model;
  dynamics::Workspace workspace;
  std::vector<BodyPose> poses;
  std::vector<dynamics::BodyVelocity> velocities;
  std::vector<collision::Pose> X_WB;
  std::vector<double> reach;
  std::vector<dynamics::Contact> contacts;
  std::vector<int> apart;  ///< bodies whose contacts are left out
  std::vector<dynamics::Contact> left_out;
  static constexpr int kLeftOut = -1;
  std::vector<int> places;  ///< of each found contact in `contacts`
};

/// Poses at the beginning of a step of length h, and how far each body's surface gets in it: as fast as it is, and
/// falling for as long.
void Scene::Data::move(dynamics::State& state, double h) {
  world_poses(model, state, poses);
  world_velocities(model, state, workspace, poses, velocities);
  X_WB.resize(poses.size());
  reach.resize(poses.size());
  const double fall = h * h * model.gravity().norm();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    X_WB[i] = {.rotation = poses[i].rotation, .position = poses[i].origin};
    if (radii[i] == 0.0) continue;
    reach[i] = h * (velocities[i].linear.norm() + velocities[i].angular.norm() * radii[i]) + fall;
  }
}

void Scene::Data::collect_contacts() {
  contacts.clear();
  left_out.clear();
  places.clear();
  const auto is_apart = [this](int body) { return std::find(apart.begin(), apart.end(), body) != apart.end(); };
  for (const collision::ContactPoint& point : world.contacts()) {
    const bool solved = !is_apart(point.body_a) && !is_apart(point.body_b);
    places.push_back(solved ? static_cast<int>(contacts.size()) : kLeftOut);
    (solved ? contacts : left_out).push_back(contact_of(point, poses));
  }
}

Scene::Scene(SceneDefinition definition) : data_(std::make_unique<Data>(std::move(definition))) {}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

const dynamics::Model& Scene::model() const { return data_->model; }

SceneReport Scene::step(dynamics::State& state, const dynamics::Inputs& inputs, const dynamics::StepOptions& options) {
  assert(inputs.contacts.empty());
  Data& data = *data_;
  SceneReport report;
  dynamics::Inputs all = inputs;
  if (data.world.active()) {
    data.move(state, options.step);
    report.collision = data.world.update(data.X_WB, data.reach);
    if (report.collision.status != collision::UpdateStatus::kOk) {
      report.step.status = dynamics::StepStatus::kNotFinite;
      return report;
    }
    data.collect_contacts();
    all.contacts = data.contacts;
  }
  report.step = dynamics::step(data.model, state, data.workspace, all, options);
  return report;
}

std::span<const collision::ContactPoint> Scene::contacts() const { return data_->world.contacts(); }
const Eigen::Vector3d& Scene::contact_force(int index) const {
  static const Eigen::Vector3d kNothing = Eigen::Vector3d::Zero();
  const int place = data_->places[index];
  return place == Data::kLeftOut ? kNothing : data_->workspace.contact_force(place);
}
const dynamics::BodyForce& Scene::coupling_force(int index) const { return data_->workspace.coupling_force(index); }
const dynamics::BodyForce& Scene::tie_force(int index) const { return data_->workspace.tie_force(index); }
const Eigen::Vector3d& Scene::drive_torque(int index) const { return data_->workspace.drive_torque(index); }
void Scene::leave_contacts_out(std::vector<int> bodies) { data_->apart = std::move(bodies); }
std::span<const dynamics::Contact> Scene::left_out() const { return data_->left_out; }
dynamics::Workspace& Scene::workspace() { return data_->workspace; }
void Scene::forget() { data_->world.forget(); }

}  // namespace layfigure::scene
