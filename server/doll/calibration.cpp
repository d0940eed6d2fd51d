#include "calibration.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "section_law.h"
#include "settings_numbers.h"

namespace layfigure::doll {
namespace {

using dynamics::BodyDefinition;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPinFrequency = 2.0 * std::numbers::pi * 10.0;  // [rad/s]; sags 2.5 mm under any doll's weight

/// A limb as one rigid body, in the axes of its first body, from that body's joint.
struct Limb {
  double mass{0.0};
  double reach{0.0};                   ///< sum of mass times distance along the stretched-out limb [kg m]
  Vector3d first{Vector3d::Zero()};    ///< mass times com [kg m]
  Matrix3d inertia{Matrix3d::Zero()};  ///< about the joint [kg m^2]
};

Matrix3d point_inertia(double mass, const Vector3d& p) {
  return mass * (p.squaredNorm() * Matrix3d::Identity() - p * p.transpose());
}

/// Adds `limb`, which hangs on a joint at `body.anchor`, to its parent's.
void add_to_parent(const BodyDefinition& body, const Limb& limb, Limb& parent) {
  const Matrix3d R = body.rest_rotation.toRotationMatrix();
  const Vector3d com_limb = limb.first / limb.mass;
  const Vector3d com_parent = body.anchor + R * com_limb;
  const Matrix3d about_com = R * (limb.inertia - point_inertia(limb.mass, com_limb)) * R.transpose();
  parent.mass += limb.mass;
  parent.reach += limb.reach + limb.mass * body.anchor.norm();
  parent.first += limb.mass * com_parent;
  parent.inertia += about_com + point_inertia(limb.mass, com_parent);
}

std::vector<Limb> make_limbs(const dynamics::ModelDefinition& definition) {
  std::vector<Limb> limbs(definition.bodies.size());
  for (int b = static_cast<int>(limbs.size()) - 1; b >= 0; --b) {  // children first
    const BodyDefinition& body = definition.bodies[b];
    limbs[b].mass += body.mass;
    limbs[b].reach += body.mass * body.com.norm();
    limbs[b].first += body.mass * body.com;
    limbs[b].inertia += body.inertia + point_inertia(body.mass, body.com);
    if (body.parent >= 0) add_to_parent(body, limbs[b], limbs[body.parent]);
  }
  return limbs;
}

double largest_moment(const Matrix3d& inertia) {
  return Eigen::SelfAdjointEigenSolver<Matrix3d>(inertia, Eigen::EigenvaluesOnly).eigenvalues()[2];
}

/// Raises `value` to `least`, and says why if that changed it.
void raise(double& value, double least, const char* why, Reason& reason) {
  if (value >= least) return;
  value = least;
  reason = {Origin::kRaised, why};
}

/// Each axis by itself, so that the weakest one holds and the others are not made stronger than they need be.
void raise(Vector3d& values, const Vector3d& least, const char* why, Reason& reason) {
  for (int k = 0; k < 3; ++k) raise(values[k], least[k], why, reason);
}

Reason reason_of_section(const Section& section) {
  return section.estimated ? Reason{Origin::kEstimate, "estimated section"} : Reason{Origin::kSection, "section"};
}

void report(const std::string& what, const std::vector<std::string>& names, Doll& doll) {
  if (names.empty()) return;
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  doll.warnings.push_back(what + list);
}

void pin_root(Doll& doll, const Limb& whole) {
  const Matrix3d about_com = whole.inertia - point_inertia(whole.mass, whole.first / whole.mass);
  const double moment = largest_moment(about_com);
  doll.root_pin.stiffness = whole.mass * kPinFrequency * kPinFrequency;
  doll.root_pin.damping = 2.0 * whole.mass * kPinFrequency;
  doll.root_pin.angular_stiffness = moment * kPinFrequency * kPinFrequency;
  doll.root_pin.angular_damping = 2.0 * moment * kPinFrequency;
}

}  // namespace

std::vector<LimbLoad> limb_loads(const dynamics::ModelDefinition& definition) {
  std::vector<LimbLoad> loads;
  for (const Limb& limb : make_limbs(definition)) {
    loads.push_back({definition.gravity.norm() * limb.reach, largest_moment(limb.inertia)});
  }
  return loads;
}

void calibrate(Doll& doll, const DollSettings& settings) {
  const std::vector<LimbLoad> loads = limb_loads(doll.definition);
  for (std::size_t b = 0; b < loads.size(); ++b) {
    BodyDefinition& body = doll.definition.bodies[b];
    if (body.parent < 0) continue;
    Reasons& why = doll.reasons[b];
    const Section& section = doll.sections[b];
    why.stiffness = why.damping = why.flow_damping = why.yield_torque = reason_of_section(section);
    why.hardening = settings.hardening > 0.0 ? reason_of_section(section)
                                             : Reason{Origin::kDefault, why_of_number(settings, "hardening")};
    AxisLaw law = axis_law(section, settings);
    raise(law.yield_torque, Vector3d::Constant(settings.hold_margin * loads[b].weight_torque),
          "raised to hold the limb's weight", why.yield_torque);
    raise(law.stiffness, Vector3d::Constant(loads[b].weight_torque / settings.largest_sag),
          "raised to bear the limb's weight", why.stiffness);
    raise(law.stiffness, law.yield_torque / settings.largest_strain, "raised to yield in time", why.stiffness);
    raise(law.damping, 2.0 * settings.damping_ratio * (law.stiffness * loads[b].inertia).cwiseSqrt(),
          "raised to damp the limb", why.damping);
    body.joint = joint_law(law, section, settings);
    raise(body.joint.flow_damping, 2.0 * body.joint.yield_torque / settings.largest_flow_rate, "raised to flow slowly",
          why.flow_damping);
  }
  pin_root(doll, make_limbs(doll.definition).front());
}

void report_raised(Doll& doll) {
  std::vector<std::string> strengthened;
  std::vector<std::string> stiffened;
  for (std::size_t b = 0; b < doll.reasons.size(); ++b) {
    const Reasons& why = doll.reasons[b];
    const std::string& name = doll.definition.bodies[b].name;
    if (why.yield_torque.origin == Origin::kRaised) strengthened.push_back(name);
    if (why.stiffness.origin == Origin::kRaised) stiffened.push_back(name);
  }
  report("yield torque raised to hold the limb's weight: ", strengthened, doll);
  report("stiffness raised to bear the limb's weight or to yield in time: ", stiffened, doll);
}

}  // namespace layfigure::doll
