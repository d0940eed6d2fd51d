#include "stress_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "layfigure/math/rotation.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

constexpr double kUnitTolerance = 1e-12;
// Of a bone's length, and of how far from the world's origin it is, which is what its ends are known to.
constexpr double kLengthTolerance = 1e-12;
// The answers of a solved problem obey their laws to its tolerance, a fallback's exactly.
constexpr double kLawTolerance = 1e-8;
// Overlaps beyond this part of the smallest shape need not be measured along the best normal.
constexpr double kDeep = 0.1;

std::string named(const char* what, std::size_t index) { return what + std::string(" ") + std::to_string(index); }

bool within(double size, double most) { return std::isfinite(size) && size <= most * (1.0 + kLawTolerance); }

/// What a step may bring a body's surface nearer to another's without any contact's noticing: how far its com got off
/// the way of its velocity, the bow of its turn, and what it moved beyond the reach within which contacts were looked
/// for (scene.cpp).
double unforeseen(const Model& model, const std::vector<BodyPose>& from, const std::vector<BodyPose>& to,
                  const State& before, const State& after, int body, double radius, double h) {
  const Eigen::Matrix3d R = from[body].rotation.toRotationMatrix();
  const Eigen::Matrix3d least =
      model.body(body).mass * kSmallestGyration * kSmallestGyration * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d inertia = R * (model.body(body).inertia + least) * R.transpose();
  const Eigen::Vector3d spin = inertia.inverse() * before.bodies[body].angular_momentum;
  const double speed = before.bodies[body].linear_momentum.norm() / model.body(body).mass;
  const double reach = h * (speed + spin.norm() * radius + h * model.gravity().norm());
  // A turn of more than half a revolution does not show.
  const double seen = math::log_rotation(to[body].rotation * from[body].rotation.conjugate()).norm();
  const double turn = std::max(seen, h * spin.norm());
  const Eigen::Vector3d moved = to[body].com - from[body].com;
  const double off = (moved - h / model.body(body).mass * after.bodies[body].linear_momentum).norm();
  return off + std::min(turn, 1.0) * turn * radius + std::max(moved.norm() + turn * radius - reach, 0.0);
}

}  // namespace

std::string broken_geometry(const Model& model, const State& state) {
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  for (int i = 0; i < model.size(); ++i) {
    const BodyState& body = state.bodies[i];
    if (!(std::abs(body.rotation.norm() - 1.0) <= kUnitTolerance)) return named("rotation not unit: body", i);
    if (!(std::abs(body.rest_rotation.norm() - 1.0) <= kUnitTolerance)) return named("rest not unit: body", i);
    const int parent = model.body(i).parent;
    if (parent < 0) continue;
    const double length = model.body(i).anchor.norm();
    const double size = length + poses[i].origin.norm() + poses[parent].origin.norm();
    const double error = (poses[i].origin - poses[parent].origin).norm() - length;
    if (!(std::abs(error) <= kLengthTolerance * size)) return named("bone of another length: body", i);
  }
  return "";
}

std::string broken_answer(const scene::Scene& stepper, const StressScene& scene) {
  for (std::size_t k = 0; k < stepper.contacts().size(); ++k) {
    const collision::ContactPoint& contact = stepper.contacts()[k];
    const Eigen::Vector3d& force = stepper.contact_force(static_cast<int>(k));
    const double normal = force.dot(contact.normal_W);
    const double tangential = (force - normal * contact.normal_W).norm();
    if (!(normal >= -kLawTolerance * force.norm()) || !std::isfinite(normal)) return named("pulling contact", k);
    if (!within(tangential, contact.friction * normal + kLawTolerance * normal)) return named("friction of contact", k);
  }
  for (std::size_t k = 0; k < scene.ties.size(); ++k) {
    const BodyForce& exerted = stepper.tie_force(static_cast<int>(k));
    if (!within(exerted.force.lpNorm<Eigen::Infinity>(), scene.ties[k].max_force)) return named("force of tie", k);
    if (!within(exerted.torque.lpNorm<Eigen::Infinity>(), scene.ties[k].max_torque)) return named("torque of tie", k);
  }
  for (std::size_t k = 0; k < scene.drives.size(); ++k) {
    const Eigen::Vector3d& torque = stepper.drive_torque(static_cast<int>(k));
    if (!within(torque.norm(), scene.drives[k].max_torque)) return named("torque of drive", k);
  }
  return "";
}

OverlapBound::OverlapBound(const scene::SceneDefinition& definition)
    : radii_(definition.model.bodies.size(), 0.0),
      smallest_(std::numeric_limits<double>::infinity()),
      allowed_(std::numeric_limits<double>::infinity()),
      watching_(!definition.shapes.empty()) {
  for (const collision::ShapeDefinition& shape : definition.shapes) {
    if (shape.body < 0) continue;
    const double radius = collision::radius_of(shape.shape);
    const double offset = (shape.X_BS.position - definition.model.bodies[shape.body].com).norm();
    radii_[shape.body] = std::max(radii_[shape.body], offset + radius);
    smallest_ = std::min(smallest_, radius);
  }
}

std::string OverlapBound::grown(const scene::Scene& stepper, const State& before, const State& after, double h,
                                bool infeasible) {
  if (!watching_) return "";
  double deepest = 0.0;
  for (const collision::ContactPoint& contact : stepper.contacts()) deepest = std::max(deepest, -contact.gap);
  if (deepest > allowed_) {
    std::ostringstream text;
    text << "overlap of " << deepest << " m instead of " << allowed_;
    return text.str();
  }
  watching_ = !infeasible && deepest <= kDeep * smallest_;
  const Model& model = stepper.model();
  std::vector<BodyPose> from, to;
  world_poses(model, before, from);
  world_poses(model, after, to);
  double largest = 0.0;
  for (int i = 0; i < model.size(); ++i) {
    if (radii_[i] == 0.0) continue;
    largest = std::max(largest, unforeseen(model, from, to, before, after, i, radii_[i], h));
  }
  // Both bodies of a pair; and what measuring rounds.
  allowed_ = deepest + 2.0 * largest + 1e-9;
  return "";
}

}  // namespace layfigure::testing
