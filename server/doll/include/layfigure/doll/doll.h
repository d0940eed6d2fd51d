#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

#include "layfigure/character/rig.h"
#include "layfigure/collision/shapes.h"
#include "layfigure/doll/bone_role.h"
#include "layfigure/doll/settings.h"
#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"

namespace layfigure::doll {

/// A spring and damper that pins the root body where it starts.
struct RootPin {
  double stiffness{0.0};          ///< [N/m]
  double damping{0.0};            ///< [N s/m]
  double angular_stiffness{0.0};  ///< [N m/rad]
  double angular_damping{0.0};    ///< [N m s/rad]
};

/// The mesh's cross-section at a joint, cut by the plane across the bone, in axes S of its own: x across the cut, along
/// the bone (twist), y and z the principal axes of bending through its centroid, I_y >= I_z (named as in EN 1993-1-1).
/// A round section has none; its y is one of the bone's own axes, laid into the cut.
struct Section {
  Eigen::Quaterniond axes{Eigen::Quaterniond::Identity()};  ///< R_BS
  double area{0.0};                                         ///< [m^2]
  Eigen::Vector3d second_moments{Eigen::Vector3d::Zero()};  ///< J = I_y + I_z, I_y, I_z [m^4]
  Eigen::Vector3d outermost{Eigen::Vector3d::Zero()};       ///< c: farthest from the centroid, from y, from z [m]
  double span{0.0};                                         ///< s, distance between the coms of the two bodies [m]
  bool estimated{false};                 ///< no closed cut was found; a circle, taken from the body's own size
  std::vector<Eigen::Vector3d> outline;  ///< of the cut, a closed polygon in the body's frame [m]; estimated: empty
};

/// What a body is made of, and what it is to other bodies that it meets.
struct Matter {
  double density{0.0};                ///< [kg/m^3]
  ShapeKind shape{ShapeKind::kHull};  ///< for contacts
  double friction{0.5};               ///< Coulomb's coefficient; a contact takes the geometric mean of its two
};

/// Where a number of the doll comes from.
enum class Origin {
  kDefault,
  kSection,   ///< the section of the mesh
  kEstimate,  ///< a section that was estimated
  kRaised,    ///< to a minimum
  kFile,      ///< the character's file says so
  kSettings,  ///< the settings say so
};

/// Why a number is what it is; the text says it in a few words, such as "line 12 of the settings".
struct Reason {
  Origin origin{Origin::kDefault};
  std::string text{"default"};
};

/// Of what a body and its joint to the parent have; a root's joint has none.
struct Reasons {
  Reason density;
  Reason stiffness;
  Reason damping;
  Reason flow_damping;
  Reason yield_torque;
  Reason hardening;
  Reason twist{Origin::kDefault, "no limit"};  ///< its limit, as those of the swings
  Reason swing_y{Origin::kDefault, "no limit"};
  Reason swing_z{Origin::kDefault, "no limit"};
  Reason locked;
  Reason shape;
  Reason friction;
};

/// What is chosen for a joint.
struct JointChoice {
  dynamics::JointLaw law;
  dynamics::JointLimits limits;
};

/// What a bone moves with, rigidly: its own body; else its nearest ancestor's; above the root body, the root body.
struct Carrier {
  int body{-1};  ///< -1: the bone's whole tree has no body; it stays where it is
  Eigen::Isometry3d pose{Eigen::Isometry3d::Identity()};  ///< X_BA of the bone's frame A in the body's; no body: X_WA
};

/// A rig as an elasto-plastic doll. A body's frame is its bone's frame.
struct Doll {
  character::Rig rig;
  dynamics::ModelDefinition definition;  ///< free root; starts in the rest pose with nothing strained
  RootPin root_pin;
  std::vector<int> body_of_bone;  ///< index into definition.bodies, -1: the bone rides rigidly on its parent bone
  std::vector<int> bone_of_body;
  std::vector<BoneRole> bone_roles;  ///< one per bone: why it is a body, or none
  std::vector<int> mirror_of_body;   ///< its image on the other side; itself in the middle, -1: none
  Eigen::Vector3d mirror_normal{Eigen::Vector3d::UnitX()};  ///< of the plane between them in the bind pose, world,
                                                            ///< unit; to the left, where names say which side that is
  double mirror_offset{0.0};                                ///< the plane: normal . x = offset [m]
  std::vector<Carrier> carriers;                            ///< one per bone
  std::vector<Section> sections;                            ///< one per body; a root's is that of its own middle
  std::vector<JointChoice> chosen_joints;                   ///< one per body: before the settings change single joints
  std::vector<collision::ShapeDefinition> shapes;           ///< what the bodies touch each other with
  std::vector<std::pair<int, int>> never_touch;  ///< bodies, beside parents and children, that overlap at rest
  std::vector<Matter> matter;                    ///< one per body
  std::vector<Reasons> reasons;                  ///< one per body
  std::vector<Reason> body_reasons;              ///< one per bone: why it is a body, or rides on one
  DollSettings settings;                         ///< that it was made by
  std::vector<std::string> warnings;
};

/// The pose of every bone of the rig, bones that ride along included: what a skeleton animation needs.
struct SkeletonPose {
  Eigen::Vector3d root_translation{Eigen::Vector3d::Zero()};  ///< of the first root bone, world [m]
  std::vector<Eigen::Quaterniond> rotations;                  ///< bone -> parent bone; a root's: bone -> world
  std::vector<Eigen::Quaterniond> rest_rotations;             ///< where each joint springs back to
  std::vector<Eigen::Vector3d> torques;  ///< in the bone's frame [N m]; 0 for bones that ride along
  std::vector<bool> yielding;
};

/// Fills `pose` from `state`. O(bones). Reuses the memory of `pose`.
void skeleton_pose(const Doll& doll, const dynamics::State& state, SkeletonPose& pose);

}  // namespace layfigure::doll
