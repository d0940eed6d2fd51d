#include "layfigure/dynamics/model.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace layfigure::dynamics {
namespace {

// A quaternion read from a text file with six digits is off by this much; more is a mistake.
constexpr double kUnitTolerance = 1e-6;
// Relative slack of the triangle inequality and of symmetry for inertias that were rounded on the way.
constexpr double kInertiaTolerance = 1e-6;

class Check {
 public:
  Check(const BodyDefinition& body, int index) : body_(body), index_(index) {}

  void at_least_zero(const char* what, double value) const {
    if (!(value >= 0.0) || !std::isfinite(value)) fail(what, value, "finite and >= 0");
  }
  void positive(const char* what, double value) const {
    if (!(value > 0.0) || !std::isfinite(value)) fail(what, value, "finite and > 0");
  }
  void at_least_zero_or_infinite(const char* what, double value) const {
    if (!(value >= 0.0)) fail(what, value, ">= 0 or infinity");
  }
  void ratio(const char* what, double value) const {
    if (!(value > 0.0)) fail(what, value, "> 0 or infinity");
  }
  void finite(const char* what, const Eigen::Vector3d& value) const {
    if (!value.allFinite()) fail(what, value.transpose(), "finite");
  }
  void unit(const char* what, const Eigen::Quaterniond& q) const {
    if (!(std::abs(q.norm() - 1.0) <= kUnitTolerance)) fail(what, q.norm(), "of norm 1");
  }
  void inertia(const Eigen::Matrix3d& matrix) const {
    if (!matrix.allFinite()) fail("inertia", matrix.trace(), "finite");
    const double scale = matrix.cwiseAbs().maxCoeff();
    if ((matrix - matrix.transpose()).cwiseAbs().maxCoeff() > kInertiaTolerance * scale) {
      fail("inertia asymmetry", (matrix - matrix.transpose()).cwiseAbs().maxCoeff(), "0");
    }
    const Eigen::Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(matrix).eigenvalues();
    if (moments[0] < -kInertiaTolerance * scale) fail("smallest principal moment", moments[0], ">= 0");
    if (moments[2] > moments[0] + moments[1] + kInertiaTolerance * scale) {
      fail("largest principal moment", moments[2], "at most the sum of the other two");
    }
  }
  void limits(const JointLimits& limits) const {
    unit("limit axes", limits.axes);
    unit("limit reference", limits.reference);
    if (!(limits.twist_lower <= 0.0)) fail("lower twist limit", limits.twist_lower, "<= 0");
    if (!(limits.twist_upper >= 0.0)) fail("upper twist limit", limits.twist_upper, ">= 0");
    for (int k = 0; k < 2; ++k) {
      if (!(limits.swing_lower[k] > 0.0)) fail("lower swing limit", limits.swing_lower[k], "> 0");
      if (!(limits.swing_upper[k] > 0.0)) fail("upper swing limit", limits.swing_upper[k], "> 0");
    }
  }
  void parent(int value) const {
    if (value < -1 || value >= index_) fail("parent", value, "an earlier body, or -1");
  }

 private:
  template <class Value>
  [[noreturn]] void fail(const char* what, const Value& value, const char* expected) const {
    std::ostringstream text;
    text << "body " << index_ << " '" << body_.name << "': " << what << " = " << value << ", expected " << expected;
    throw std::invalid_argument(text.str());
  }

  const BodyDefinition& body_;
  int index_;
};

void check_body(const BodyDefinition& body, int index) {
  const Check check(body, index);
  check.parent(body.parent);
  check.finite("anchor", body.anchor);
  check.unit("rotation", body.rotation);
  check.unit("rest rotation", body.rest_rotation);
  check.positive("mass", body.mass);
  check.finite("com", body.com);
  check.inertia(body.inertia);
  check.at_least_zero_or_infinite("stiffness", body.joint.stiffness);
  check.at_least_zero("damping", body.joint.damping);
  check.at_least_zero("flow damping", body.joint.flow_damping);
  check.at_least_zero_or_infinite("yield torque", body.joint.yield_torque);
  check.at_least_zero("hardening", body.joint.hardening);
  check.unit("section axes", body.joint.shape.axes);
  for (int k = 0; k < 3; ++k) {
    check.at_least_zero("stiffness ratio", body.joint.shape.stiffness[k]);
    check.at_least_zero("damping ratio", body.joint.shape.damping[k]);
    check.ratio("yield ratio", body.joint.shape.yield[k]);
  }
  check.limits(body.limits);
}

}  // namespace

Model::Model(ModelDefinition definition) : definition_(std::move(definition)) {
  if (definition_.bodies.empty()) throw std::invalid_argument("model: 0 bodies, expected at least 1");
  if (!definition_.gravity.allFinite())
    throw std::invalid_argument("model: gravity is not finite, expected three finite numbers");
  for (int i = 0; i < size(); ++i) {
    BodyDefinition& body = definition_.bodies[i];
    check_body(body, i);
    body.rotation.normalize();
    body.rest_rotation.normalize();
    body.joint.shape.axes.normalize();
    body.limits.axes.normalize();
    body.limits.reference.normalize();
  }
}

int Model::find(const std::string& name) const {
  for (int i = 0; i < size(); ++i) {
    if (body(i).name == name) return i;
  }
  return -1;
}

}  // namespace layfigure::dynamics
