#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>

#include "layfigure/character/rig.h"
#include "layfigure/doll/doll.h"

namespace layfigure::doll::test {

/// How a person is bound.
struct Person {
  double arm_slope{0.0};  ///< of the arms below level, 0: T-pose [rad]
  double roll{0.0};       ///< of every bone's axes about the bone, growing from bone to bone [rad]
  bool fingers{true};
  double scale{1.0};
  std::string spine{"Spine"};
};

/// A person of prisms, 1.8 m tall, feet on the ground, looking along -Y, palms down, bones called as Mixamo does: Hips,
/// Spine, Chest, Neck, Head, LeftShoulder, LeftArm, LeftForeArm, LeftHand, LeftHandThumb1 to 3, .., LeftUpLeg, LeftLeg,
/// LeftFoot, LeftToeBase, the same on the right. Rigid weights.
[[nodiscard]] character::Rig make_person(const Person& person = {});

/// Adds a bone from `head` to `tail` with an eight-sided prism about it; -1: a root. Returns its index.
int add_limb(character::Rig& rig, const std::string& name, int parent, const Eigen::Vector3d& head,
             const Eigen::Vector3d& tail, double radius, double roll = 0.0);

/// The whole rig reflected in the plane x = 0. Names stay.
[[nodiscard]] character::Rig reflected(const character::Rig& rig);

[[nodiscard]] int body_called(const Doll& doll, const std::string& name);

/// How far the joint is from its limits when its body is turned by `turn`, a rotation vector in the world, from the
/// bind pose, all else as bound [rad]; negative: beyond.
[[nodiscard]] double gap(const Doll& doll, int body, const Eigen::Vector3d& turn);

/// Whether the joint can turn so far about a world axis.
[[nodiscard]] bool allows(const Doll& doll, const std::string& name, const Eigen::Vector3d& axis, double angle_deg);

}  // namespace layfigure::doll::test
