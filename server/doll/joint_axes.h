#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "body_layout.h"
#include "mirror.h"

namespace layfigure::doll {

/// The directions of a character as it stands in its bind pose, unit, world.
struct BodyAxes {
  Eigen::Vector3d up{Eigen::Vector3d::UnitZ()};
  Eigen::Vector3d forward{-Eigen::Vector3d::UnitY()};
  Eigen::Vector3d left{Eigen::Vector3d::UnitX()};
};

/// Up is the world's Z, across the mirror's plane. Forward is where the feet point, from the ankle to the toes; where
/// there are no feet, it is forward to those whose left is where the names say. None: not mirrored, or neither.
[[nodiscard]] std::optional<BodyAxes> find_body_axes(const BodyLayout& layout, const Mirror& mirror);

/// A joint's neutral pose and what it is measured by. Columns of the matrices: x along the limb; y = x cross f, about
/// which the limb swings towards f; z = x cross y. Both are world, in the bind pose.
struct JointAxes {
  Eigen::Matrix3d child{Eigen::Matrix3d::Identity()};    ///< fixed in the body
  Eigen::Matrix3d neutral{Eigen::Matrix3d::Identity()};  ///< fixed in its parent: where the child's are when neutral
  Eigen::Vector3d a{Eigen::Vector3d::UnitY()};           ///< the range's second direction, world
};

/// The axes of body `b`'s joint by what it is, from where its joint and its neighbours' are, whatever the axes of the
/// bones. The limb runs from its joint to the next body's (of a hand, to the middle of the fingers' first joints), of
/// the last one to its com; a head's is up, its com being in front of the neck.
///
///     part              f                  a             neutral
///     spine, chest      forward            left          bind pose
///     neck, head        forward            left          bind pose
///     jaw, eye          down; up           left          bind pose
///     clavicle          forward            up            bind pose
///     upper arm         forward, level     up            as the cone's axis
///     forearm           (2)                (1)           in line with the upper arm
///     hand              the palm           thumb's side  in line with the forearm
///     finger 1          the palm           thumb's side  in line with the hand
///     fingers 2 and 3   the palm           thumb's side  in line with the bone above
///     thumb 1           across the palm    palm          bind pose
///     thumb 2 and 3     across the palm    palm          in line with the bone above
///     thigh             forward            outward       straight down
///     shin              backward           (1)           in line with the thigh
///     foot              towards the shin   outward       bind pose
///     toes              up                 outward       bind pose
///
/// (1) of no account: the ranges are the same on both sides. (2) where the elbow bends, which is forward. "In line"
/// leaves out the flexion alone: a slight bend to the side is as the sculptor meant it.
///
/// Forward of an arm is what becomes of forward when the arm is turned from straight out to where it is, the shortest
/// way; of a leg, from straight down. A joint that is bent by more than 20 degrees tells its own axis instead. The palm
/// faces where it must for a thumb on the side of the index finger's knuckle; without fingers the thumb points to where
/// the elbow bends.
///
/// The upper arm's cone points outward, 20 degrees forward and 40 down. The arm's twist is zero where the elbow bends
/// forward, in the mean of hanging and straight out.
///
/// None: the part is not known, or its directions are not (no body axes; f along the limb).
[[nodiscard]] std::optional<JointAxes> find_joint_axes(const BodyLayout& layout, const Mirror& mirror,
                                                       const std::optional<BodyAxes>& body_axes, int b);

/// Axes for a limb of which no more than its direction is known; they measure from the bind pose.
[[nodiscard]] JointAxes plain_axes(const Eigen::Vector3d& limb);

}  // namespace layfigure::doll
