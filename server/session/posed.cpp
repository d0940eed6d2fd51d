#include "layfigure/session/posed.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "layfigure/math/rotation.h"

namespace layfigure::session {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Of the weight that turns a root, which turns the weight: each pass leaves of the error what the pin turns by [rad].
constexpr int kRootPasses = 4;

struct Place {
  Quaterniond rotation;  ///< R_WB
  Vector3d origin;       ///< p_WBo [m]
};

/// What hangs on a joint, with its own body.
struct Limb {
  double mass{0.0};
  Vector3d moment{Vector3d::Zero()};  ///< sum of mass times com, world [kg m]
};

class Statics {
 public:
  Statics(const doll::Doll& doll, haptics::DollMemory& memory)
      : doll_(doll), bodies_(doll.definition.bodies), memory_(memory), places_(bodies_.size()), limbs_(bodies_.size()) {
    find_places();
  }

  void balance_roots() {
    for (int pass = 0; pass < kRootPasses; ++pass) {
      for (std::size_t i = 0; i < bodies_.size(); ++i) {
        if (bodies_[i].parent < 0) balance_root(i);
      }
      find_places();
    }
  }

  void balance_joints() {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (bodies_[i].parent >= 0 && std::isfinite(bodies_[i].joint.yield_torque)) balance_joint(i);
    }
  }

 private:
  [[nodiscard]] Vector3d com(std::size_t i) const { return places_[i].origin + places_[i].rotation * bodies_[i].com; }

  /// Of gravity on the limb about a point, world [N m].
  [[nodiscard]] Vector3d weight_moment(const Limb& limb, const Vector3d& about) const {
    return (limb.moment - limb.mass * about).cross(doll_.definition.gravity);
  }

  void find_places() {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const haptics::JointMemory& joint = memory_.joints[i];
      if (const int parent = bodies_[i].parent; parent < 0) {
        places_[i] = {joint.rotation, joint.position};
      } else {
        const Place& above = places_[parent];
        places_[i] = {(above.rotation * joint.rotation).normalized(),
                      above.origin + above.rotation * bodies_[i].anchor};
      }
      limbs_[i] = {bodies_[i].mass, bodies_[i].mass * com(i)};
    }
    for (std::size_t i = bodies_.size(); i-- > 0;) {
      if (bodies_[i].parent < 0) continue;
      limbs_[bodies_[i].parent].mass += limbs_[i].mass;
      limbs_[bodies_[i].parent].moment += limbs_[i].moment;
    }
  }

  void balance_root(std::size_t i) {
    const doll::RootPin& pin = doll_.root_pin;
    if (!(pin.stiffness > 0.0 && pin.angular_stiffness > 0.0)) return;
    const dynamics::BodyDefinition& made = bodies_[i];
    const Vector3d turn = weight_moment(limbs_[i], com(i)) / pin.angular_stiffness;
    const Vector3d sag = limbs_[i].mass * doll_.definition.gravity / pin.stiffness;
    haptics::JointMemory& root = memory_.joints[i];
    root.rotation = (math::exp_rotation(turn) * made.rotation).normalized();
    root.position = made.anchor + made.rotation * made.com + sag - root.rotation * made.com;
    root.rest_rotation = made.rest_rotation;
  }

  void balance_joint(std::size_t i) {
    const dynamics::JointLaw& law = bodies_[i].joint;
    const Quaterniond R_WS = places_[i].rotation * law.shape.axes;
    Vector3d strain = R_WS.conjugate() * weight_moment(limbs_[i], places_[i].origin);
    for (int k = 0; k < 3; ++k) {
      const double stiffness = law.stiffness * law.shape.stiffness[k];
      strain[k] = stiffness > 0.0 && !law.shape.locked[k] ? strain[k] / stiffness : 0.0;
    }
    haptics::JointMemory& joint = memory_.joints[i];
    joint.rest_rotation = (joint.rotation * math::exp_rotation(law.shape.axes * strain).conjugate()).normalized();
    joint.torque.setZero();
    joint.locked_strain.setZero();
  }

  const doll::Doll& doll_;
  const std::vector<dynamics::BodyDefinition>& bodies_;
  haptics::DollMemory& memory_;
  std::vector<Place> places_;
  std::vector<Limb> limbs_;
};

/// R_PB as near to `wanted` as the axes that are not locked can turn it from `now`.
Quaterniond reachable(const Quaterniond& now, const Quaterniond& wanted, const dynamics::JointShape& shape) {
  if (shape.locked == std::array<bool, 3>{}) return wanted.normalized();
  Vector3d turn = shape.axes.conjugate() * math::log_rotation((now.conjugate() * wanted).normalized());
  for (int k = 0; k < 3; ++k) {
    if (shape.locked[k]) turn[k] = 0.0;
  }
  return (now * math::exp_rotation(shape.axes * turn)).normalized();
}

}  // namespace

haptics::DollMemory posed(const doll::Doll& doll, const haptics::DollMemory& memory,
                          std::span<const PosedJoint> joints) {
  haptics::DollMemory result = memory;
  for (const auto& [body, rotation] : joints) {
    const dynamics::BodyDefinition& definition = doll.definition.bodies.at(body);
    if (definition.parent < 0) {
      throw std::invalid_argument("bone '" + doll.rig.bones[doll.bone_of_body[body]].name +
                                  "' is the root, which has no joint");
    }
    Quaterniond& now = result.joints[body].rotation;
    now = reachable(now, rotation, definition.joint.shape);
  }
  Statics statics(doll, result);
  statics.balance_roots();
  statics.balance_joints();
  return result;
}

}  // namespace layfigure::session
