#include "layfigure/app/joint_results.h"

#include <array>
#include <utility>

#include "layfigure/app/results.h"

namespace layfigure::app {
namespace {

/// What `values` says of each joint.
template <class Values>
void add(reply_t& reply, const char* name, const std::vector<doll::JointChoice>& joints, Values&& values) {
  std::vector<double> all;
  for (const doll::JointChoice& joint : joints) {
    for (const double value : values(joint)) all.push_back(value);
  }
  add_result(reply, name, std::move(all));
}

std::array<double, 3> three(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

std::array<double, 4> four(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

std::array<double, 2> swing(const dynamics::JointLimits& limits, int axis) {
  return {-limits.swing_lower[axis], limits.swing_upper[axis]};
}

void add_laws(reply_t& reply, const std::vector<doll::JointChoice>& joints) {
  const auto number = [&](const char* name, double dynamics::JointLaw::*value) {
    add(reply, name, joints, [=](const doll::JointChoice& joint) { return std::array{joint.law.*value}; });
  };
  const auto ratios = [&](const char* name, Eigen::Vector3d dynamics::JointShape::*value) {
    add(reply, name, joints, [=](const doll::JointChoice& joint) { return three(joint.law.shape.*value); });
  };
  number("stiffness", &dynamics::JointLaw::stiffness);
  ratios("stiffness.ratios", &dynamics::JointShape::stiffness);
  number("damping", &dynamics::JointLaw::damping);
  ratios("damping.ratios", &dynamics::JointShape::damping);
  number("yield_torque", &dynamics::JointLaw::yield_torque);
  ratios("yield_torque.ratios", &dynamics::JointShape::yield);
  number("flow_damping", &dynamics::JointLaw::flow_damping);
  number("hardening", &dynamics::JointLaw::hardening);
}

void add_limits(reply_t& reply, const std::vector<doll::JointChoice>& joints) {
  add(reply, "limits.twist", joints, [](const doll::JointChoice& joint) {
    return std::array{joint.limits.twist_lower, joint.limits.twist_upper};
  });
  add(reply, "limits.swing_y", joints, [](const doll::JointChoice& joint) { return swing(joint.limits, 0); });
  add(reply, "limits.swing_z", joints, [](const doll::JointChoice& joint) { return swing(joint.limits, 1); });
  add(reply, "limit_axes", joints, [](const doll::JointChoice& joint) { return four(joint.limits.axes); });
}

}  // namespace

void add_joints(reply_t& reply, const std::vector<doll::JointChoice>& joints) {
  add_laws(reply, joints);
  add_limits(reply, joints);
  add(reply, "locked", joints, [](const doll::JointChoice& joint) { return joint.law.shape.locked; });
  add(reply, "section_axes", joints, [](const doll::JointChoice& joint) { return four(joint.law.shape.axes); });
}

}  // namespace layfigure::app
