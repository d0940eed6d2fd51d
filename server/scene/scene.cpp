#include "layfigure/scene/scene.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

#include "layfigure/math/scrambled.h"

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

void require_length(double value, const char* what, const std::string& body) {
  if (value >= 0.0 && std::isfinite(value)) return;
  throw std::invalid_argument("the pad of body '" + body + "' has " + what + " " + std::to_string(value) +
                              " m, expected 0 or more");
}

/// Each body's pad; of radius 0: none.
std::vector<Pad> pads_of(const SceneDefinition& definition) {
  std::vector<Pad> pads(definition.model.bodies.size());
  for (const Pad& pad : definition.pads) {
    if (pad.body < 0 || pad.body >= static_cast<int>(pads.size())) {
      throw std::invalid_argument("a pad is on body " + std::to_string(pad.body) + ", expected 0 to " +
                                  std::to_string(static_cast<int>(pads.size()) - 1));
    }
    const std::string& name = definition.model.bodies[pad.body].name;
    require_length(pad.radius, "radius", name);
    require_length(pad.depth, "depth", name);
    if (pad.radius > pads[pad.body].radius) pads[pad.body] = pad;
  }
  return pads;
}

std::pair<int, int> ordered(int a, int b) { return std::minmax(a, b); }

/// Unit vectors across the normal, evenly about it.
std::array<Eigen::Vector3d, kPadPoints> around(const Eigen::Vector3d& normal) {
  const Eigen::Vector3d other = std::abs(normal.x()) < 0.6 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d x = normal.cross(other).normalized();
  const Eigen::Vector3d y = normal.cross(x);
  std::array<Eigen::Vector3d, kPadPoints> directions;
  for (int k = 0; k < kPadPoints; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kPadPoints;
    directions[k] = std::cos(angle) * x + std::sin(angle) * y;
  }
  return directions;
}

Eigen::Vector3d in_body(const std::vector<BodyPose>& poses, int body, const Eigen::Vector3d& point) {
  if (body == collision::kWorldBody) return point;
  return poses[body].rotation.conjugate() * (point - poses[body].origin);
}

/// One name from the two shapes and the feature; that two points may share one only costs iterations.
std::uint64_t key_of(const collision::ContactPoint& point) {
  std::uint64_t key = point.feature;
  // Features and shapes are both small numbers: scrambled first, so that they do not cancel.
  for (const int shape : {point.shape_a, point.shape_b}) key = math::scrambled(key) ^ static_cast<std::uint64_t>(shape);
  return math::scrambled(key);
}

/// With both points moved by `shift` [m], world.
dynamics::Contact contact_of(const collision::ContactPoint& point, const std::vector<BodyPose>& poses,
                             const Eigen::Vector3d& shift) {
  dynamics::Contact contact;
  contact.body_a = point.body_a;
  contact.body_b = point.body_b == collision::kWorldBody ? dynamics::kWorld : point.body_b;
  contact.point_a = in_body(poses, point.body_a, point.p_Wa + shift);
  contact.point_b = in_body(poses, point.body_b, point.p_Wb + shift);
  contact.normal = point.normal_W;
  contact.friction = point.friction;
  contact.key = key_of(point);
  return contact;
}

/// A contact's pad.
struct PadAt {
  double radius;           ///< 0: none
  Eigen::Vector3d middle;  ///< from the contact point, world
};

}  // namespace

struct Scene::Data {
  Data(SceneDefinition definition, const Data* like, int threads)
      : radii(scene::radii(definition)),
        pads(pads_of(definition)),
        world(like == nullptr ? collision::World(world_definition(definition))
                              : collision::World(world_definition(definition), like->world)),
        model(std::move(definition.model)),
        workspace(model, threads) {}

  void move(dynamics::State& state, double h);
  void place();
  void collect_contacts();
  [[nodiscard]] bool is_apart(int body) const;
  void add_contact(const collision::ContactPoint& point);
  [[nodiscard]] PadAt pad_of(const collision::ContactPoint& point) const;

  std::vector<double> radii;
  std::vector<Pad> pads;  ///< one per body
  collision::World world;
  dynamics::Model model;
  dynamics::Workspace workspace;
  std::vector<BodyPose> poses;
  std::vector<dynamics::BodySpeed> speeds;
  std::vector<collision::Pose> X_WB;
  std::vector<double> reach;
  std::vector<dynamics::Contact> contacts;
  std::vector<int> first_contact;                ///< of each point of the world, and the end
  std::vector<std::pair<int, int>> let_through;  ///< sorted
  std::vector<int> apart;                        ///< bodies whose contacts are left out
  std::vector<dynamics::Contact> left_out;
};

/// The world's poses are those of `poses`.
void Scene::Data::place() {
  X_WB.resize(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) X_WB[i] = {.rotation = poses[i].rotation, .position = poses[i].origin};
}

/// Poses at the beginning of a step of length h, and how far each body's surface gets in it: as fast as it is, and
/// falling for as long.
void Scene::Data::move(dynamics::State& state, double h) {
  world_poses(model, state, poses);
  world_speeds(model, state, workspace, poses, speeds);
  place();
  reach.resize(poses.size());
  const double fall = h * h * model.gravity().norm();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (radii[i] == 0.0) continue;
    reach[i] = h * (speeds[i].linear + speeds[i].angular * radii[i]) + fall;
  }
}

PadAt Scene::Data::pad_of(const collision::ContactPoint& point) const {
  const Pad& a = pads[point.body_a];
  if (point.body_b == collision::kWorldBody || pads[point.body_b].radius <= a.radius) {
    return {.radius = a.radius, .middle = a.depth * point.normal_W};
  }
  const Pad& b = pads[point.body_b];
  return {.radius = b.radius, .middle = -b.depth * point.normal_W};
}

bool Scene::Data::is_apart(int body) const { return std::find(apart.begin(), apart.end(), body) != apart.end(); }

void Scene::Data::add_contact(const collision::ContactPoint& point) {
  if (std::binary_search(let_through.begin(), let_through.end(), ordered(point.body_a, point.body_b))) return;
  std::vector<dynamics::Contact>& target = is_apart(point.body_a) || is_apart(point.body_b) ? left_out : contacts;
  const auto [radius, middle] = pad_of(point);
  if (radius == 0.0) {
    target.push_back(contact_of(point, poses, Eigen::Vector3d::Zero()));
    return;
  }
  std::uint64_t name = 0;
  for (const Eigen::Vector3d& direction : around(point.normal_W)) {
    target.push_back(contact_of(point, poses, middle + radius * direction));
    target.back().key += name++;
  }
}

void Scene::Data::collect_contacts() {
  contacts.clear();
  left_out.clear();
  first_contact.clear();
  for (const collision::ContactPoint& point : world.contacts()) {
    first_contact.push_back(static_cast<int>(contacts.size()));
    add_contact(point);
  }
  first_contact.push_back(static_cast<int>(contacts.size()));
}

Scene::Scene(SceneDefinition definition, int threads)
    : data_(std::make_unique<Data>(std::move(definition), nullptr, threads)) {}
Scene::Scene(SceneDefinition definition, const Scene& like)
    : data_(std::make_unique<Data>(std::move(definition), like.data_.get(), 1)) {}
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

Eigen::Vector3d Scene::contact_force(int index) const {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (int k = data_->first_contact[index]; k < data_->first_contact[index + 1]; ++k) {
    force += data_->workspace.contact_force(k);
  }
  return force;
}

const dynamics::BodyForce& Scene::coupling_force(int index) const { return data_->workspace.coupling_force(index); }
const dynamics::BodyForce& Scene::tie_force(int index) const { return data_->workspace.tie_force(index); }
const Eigen::Vector3d& Scene::drive_torque(int index) const { return data_->workspace.drive_torque(index); }

void Scene::let_through(std::span<const std::pair<int, int>> pairs) {
  data_->let_through.clear();
  for (const auto& [a, b] : pairs) data_->let_through.push_back(ordered(a, b));
  std::sort(data_->let_through.begin(), data_->let_through.end());
}

double Scene::depth_of(const dynamics::State& state, int body) {
  Data& data = *data_;
  if (!data.world.active()) return 0.0;
  data.world.forget();
  world_poses(data.model, state, data.poses);
  data.place();
  double deepest = 0.0;
  if (data.world.update(data.X_WB).status == collision::UpdateStatus::kOk) {
    for (const collision::ContactPoint& point : data.world.contacts()) {
      if (point.body_a == body || point.body_b == body) deepest = std::max(deepest, -point.gap);
    }
  }
  data.world.forget();
  return deepest;
}

void Scene::leave_contacts_out(std::vector<int> bodies) { data_->apart = std::move(bodies); }
std::span<const dynamics::Contact> Scene::left_out() const { return data_->left_out; }
dynamics::Workspace& Scene::workspace() { return data_->workspace; }

void Scene::forget() { data_->world.forget(); }

}  // namespace layfigure::scene
