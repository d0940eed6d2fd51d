/// The way in for whole poses: puppets, motion capture, files.
#include <algorithm>
#include <set>
#include <string>

#include "layfigure/app/arguments.h"
#include "layfigure/app/commands.h"
#include "layfigure/app/results.h"
#include "layfigure/session/posed.h"

namespace layfigure::app {
namespace {

constexpr double kMinDuration = 1e-4;    // [s]
constexpr double kMaxDuration = 3600.0;  // [s]
constexpr double kMinTorque = 1e-9;      // [N m]
constexpr double kMaxTorque = 1e9;       // [N m]

struct BoneRotation {
  int bone;
  Eigen::Quaterniond rotation;  ///< bone -> parent bone
};

std::vector<BoneRotation> rotations_argument(const Arguments& arguments, std::size_t bones) {
  const std::span<const double> numbers = arguments.any_numbers("rotations", 1.0 + kUnitTolerance);
  const std::span<const double> joints = arguments.integers("joints");
  if (numbers.empty()) throw Refusal("load_pose needs the argument 'rotations'");
  const std::size_t count = arguments.has("joints") ? joints.size() : bones;
  if (numbers.size() != 4 * count) {
    throw Refusal("argument 'rotations' has " + std::to_string(numbers.size()) + " numbers, expected 4 for each of " +
                  std::to_string(count) + " joints");
  }
  std::vector<BoneRotation> rotations;
  std::set<int> seen;
  for (std::size_t k = 0; k < count; ++k) {
    if (arguments.has("joints") && joints[k] >= static_cast<double>(bones)) {
      throw Refusal("argument 'joints' has " + std::to_string(static_cast<std::int64_t>(joints[k])) +
                    ", expected indices from 0 to " + std::to_string(bones - 1));
    }
    const int bone = arguments.has("joints") ? static_cast<int>(joints[k]) : static_cast<int>(k);
    const std::optional<Eigen::Quaterniond> rotation = unit_quaternion(numbers.subspan(4 * k).first<4>());
    if (!rotation) {
      throw Refusal("argument 'rotations': that of joint " + std::to_string(bone) + " is no unit quaternion w x y z");
    }
    if (!seen.insert(bone).second) throw Refusal("argument 'joints' has " + std::to_string(bone) + " twice");
    rotations.push_back({bone, *rotation});
  }
  return rotations;
}

/// R_PB that gives the bone its rotation; the inverse of doll::skeleton_pose().
Eigen::Quaterniond body_rotation(const doll::Doll& doll, const BoneRotation& wanted) {
  const int parent = doll.rig.bones[wanted.bone].parent;
  const Eigen::Quaterniond R_BA(doll.carriers[wanted.bone].pose.linear());
  const Eigen::Quaterniond R_PQ(doll.carriers[parent].pose.linear());
  return (R_PQ * wanted.rotation * R_BA.conjugate()).normalized();
}

bool can_turn(const doll::Doll& doll, int bone) {
  const int body = doll.body_of_bone[bone];
  if (body < 0 || doll.definition.bodies[body].parent < 0) return false;
  return !std::ranges::all_of(doll.definition.bodies[body].joint.shape.locked, [](bool axis) { return axis; });
}

std::vector<session::PosedJoint> targets_argument(const Arguments& arguments, const doll::Doll& doll) {
  std::vector<session::PosedJoint> targets;
  for (const BoneRotation& wanted : rotations_argument(arguments, doll.rig.bones.size())) {
    if (!can_turn(doll, wanted.bone)) continue;
    targets.emplace_back(doll.body_of_bone[wanted.bone], body_rotation(doll, wanted));
  }
  if (targets.empty()) throw Refusal("none of these joints can turn");
  return targets;
}

haptics::PoseRequest pose_request(const Arguments& arguments, const doll::Doll& doll) {
  haptics::PoseRequest request;
  request.duration = arguments.number("duration", kMinDuration, kMaxDuration).value_or(request.duration);
  request.max_torque = arguments.number("max_torque", kMinTorque, kMaxTorque);
  request.hold = arguments.flag("hold").value_or(false);
  request.targets = targets_argument(arguments, doll);
  return request;
}

}  // namespace

void CommandProcessor::put_pose(const Arguments& arguments, reply_t& reply) {
  for (const char* name : {"duration", "max_torque", "hold"}) {
    if (arguments.has(name)) throw Refusal("argument '" + std::string(name) + "' does not go with put");
  }
  tell(simulation_.put_pose(targets_argument(arguments, simulation_.doll()), "load_pose"), reply);
}

void CommandProcessor::load_pose(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {"rotations", "joints", "duration", "max_torque", "hold", "action"});
  const std::string action = arguments.text("action").value_or("load");
  if (action == "load") {
    simulation_.load_pose(pose_request(arguments, simulation_.doll()));
  } else if (action == "put") {
    put_pose(arguments, reply);
  } else if (action == "cancel" || action == "state") {
    if (command.argument_count > 1) throw Refusal(action + " goes with no other argument");
    if (action == "cancel") simulation_.cancel_pose();
  } else {
    throw Refusal("argument 'action' is '" + action + "', expected load, put, cancel or state");
  }
  const haptics::PoseDrives& drives = simulation_.hands().pose_drives();
  add_result(reply, "driven", {static_cast<double>(drives.count())});
  add_result(reply, "on_the_way", {static_cast<double>(drives.on_the_way(simulation_.state()))});
}

}  // namespace layfigure::app
