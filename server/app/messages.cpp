#include "layfigure/app/messages.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <vector>

#include "layfigure/messaging/protocol.h"

namespace layfigure::app {
namespace {

void fill(double (&out)[3], const Eigen::Vector3d& v) { std::ranges::copy(v, out); }

void fill(double (&out)[4], const Eigen::Quaterniond& q) {
  out[0] = q.w();
  out[1] = q.x();
  out[2] = q.y();
  out[3] = q.z();
}

std::vector<std::vector<double>> to_wire(const std::vector<Eigen::Quaterniond>& rotations) {
  std::vector<std::vector<double>> out;
  out.reserve(rotations.size());
  for (const Eigen::Quaterniond& q : rotations) out.push_back({q.w(), q.x(), q.y(), q.z()});
  return out;
}

std::vector<std::vector<float>> to_wire(const std::vector<Eigen::Vector3d>& torques) {
  std::vector<std::vector<float>> out;
  out.reserve(torques.size());
  for (const Eigen::Vector3d& t : torques) {
    out.push_back({static_cast<float>(t.x()), static_cast<float>(t.y()), static_cast<float>(t.z())});
  }
  return out;
}

/// A root body that is free or welded has no joint, whatever its definition says.
bool has_joint(const dynamics::ModelDefinition& definition, int body) {
  return body >= 0 && (definition.bodies[body].parent >= 0 || definition.root == dynamics::RootKind::kBall);
}

joint_t make_joint(const doll::Doll& doll, std::size_t index) {
  const character::Bone& bone = doll.rig.bones[index];
  const int body = doll.body_of_bone[index];
  joint_t joint{};
  joint.name = bone.name;
  joint.parent = bone.parent;
  fill(joint.rest_translation, bone.rest.translation());
  fill(joint.rest_rotation, Eigen::Quaterniond(bone.rest.linear()));
  fill(joint.bind_translation, bone.bind.translation());
  fill(joint.bind_rotation, Eigen::Quaterniond(bone.bind.linear()));
  joint.is_body = body >= 0;
  joint.yield_torque = std::numeric_limits<double>::infinity();
  if (body >= 0) joint.mass = doll.definition.bodies[body].mass;
  if (has_joint(doll.definition, body)) {
    const dynamics::JointLaw& law = doll.definition.bodies[body].joint;
    joint.stiffness = law.stiffness;
    joint.yield_torque = law.yield_torque;
  }
  return joint;
}

const char* tool_name(haptics::Tool tool) {
  switch (tool) {
    case haptics::Tool::kNone:
      return "none";
    case haptics::Tool::kGrab:
      return "grab";
    case haptics::Tool::kTouch:
      return "touch";
  }
  return "";
}

/// How fast the devices are served.
void fill_ticks(const Simulation& simulation, device_t& message) {
  const haptics::DeviceHands& devices = simulation.devices();
  message.haptic_hz = devices.ticks() * simulation.settings().physics_hz;
  const haptics::TickSummary ticks = devices.tick_window().summary();
  message.haptic_rate = ticks.rate_hz;
  message.late_ticks = devices.tick_window().whole().late;
  message.tick_us_p50 = ticks.us_p50;
  message.tick_us_p99 = ticks.us_p99;
  message.tick_us_max = ticks.us_max;
}

device_t make_device(const Simulation& simulation, int index) {
  const haptics::DeviceHands& devices = simulation.devices();
  const device::Info& info = devices.info(index);
  const device::GuardReport& report = devices.seen(index).report;
  const device::Reading& reading = devices.seen(index).reading;
  device_t message{};
  message.name = info.name;
  message.pointer = index;
  message.state = report.fault == device::Fault::kNone ? "ok" : device::fault_name(report.fault);
  if (report.last_fault != device::Fault::kNone) message.last_fault = device::fault_name(report.last_fault);
  message.faults = report.trips;
  message.share = report.share;
  message.reach = reading.position.norm() / info.reach;
  if (info.reach_angle > 0.0) {
    message.turn = reading.rotation.angularDistance(Eigen::Quaterniond::Identity()) / info.reach_angle;
  }
  message.energy = devices.seen(index).energy;
  fill_ticks(simulation, message);
  return message;
}

/// The fields that every message of a server begins with.
template <class Message>
Message begin_message(const Simulation& simulation, std::int64_t server_id) {
  Message message{};
  message.protocol_version = messaging::kProtocolVersion;
  message.time_us = simulation.time_us();
  message.server_id = server_id;
  return message;
}

}  // namespace

std::string clock_name(ClockKind clock) { return clock == ClockKind::kRealtime ? "realtime" : "lockstep"; }

std::int64_t content_hash(const doll::Doll& doll) { return std::bit_cast<std::int64_t>(doll.rig.content_hash); }

void point(const pointer_t& message, Simulation& simulation) {
  const auto& [x, y, z] = message.position;
  const auto& [qw, qx, qy, qz] = message.rotation;
  const PointerPose pose{{x, y, z}, Eigen::Quaterniond(qw, qx, qy, qz).normalized()};
  simulation.point(message.pointer, pose, message.client_id, message.sequence);
}

character_t make_character(const Simulation& simulation, std::int64_t server_id, std::int32_t mesh_bytes) {
  const doll::Doll& doll = simulation.doll();
  auto message = begin_message<character_t>(simulation, server_id);
  message.name = doll.rig.name;
  message.source_file = doll.rig.source_file;
  message.source_folder = doll.rig.source_folder;
  message.content_hash = content_hash(doll);
  message.physics_hz = simulation.settings().physics_hz;
  message.pose_hz = simulation.settings().pose_hz;
  message.clock = clock_name(simulation.settings().clock);
  message.mesh_bytes = mesh_bytes;
  message.joint_count = static_cast<std::int32_t>(doll.rig.bones.size());
  for (std::size_t i = 0; i < doll.rig.bones.size(); ++i) message.joints.push_back(make_joint(doll, i));
  return message;
}

pose_t make_pose(const Simulation& simulation, std::int64_t server_id, std::int64_t sequence,
                 doll::SkeletonPose& skeleton) {
  doll::skeleton_pose(simulation.doll(), simulation.state(), skeleton);
  auto message = begin_message<pose_t>(simulation, server_id);
  message.content_hash = content_hash(simulation.doll());
  message.sequence = sequence;
  message.step = simulation.steps();
  fill(message.root_translation, skeleton.root_translation);
  message.joint_count = static_cast<std::int32_t>(skeleton.rotations.size());
  message.rotations = to_wire(skeleton.rotations);
  message.rest_rotations = to_wire(skeleton.rest_rotations);
  message.torques = to_wire(skeleton.torques);
  message.yielded.assign(skeleton.yielding.begin(), skeleton.yielding.end());
  return message;
}

force_t make_force(const Simulation& simulation, std::int64_t server_id, std::int64_t sequence, int id,
                   const Pointer& pointer) {
  auto message = begin_message<force_t>(simulation, server_id);
  message.sequence = sequence;
  message.pointer = id;
  message.tool = tool_name(pointer.tool());
  message.joint = -1;
  fill(message.position, pointer.pose().position);
  fill(message.target, pointer.pose().position);
  if (!pointer.grip()) return message;
  const Grip& grip = *pointer.grip();
  message.attached = true;
  const std::optional<haptics::Fingertip>& fingertip = pointer.fingertip();
  message.contact = !fingertip || fingertip->touched.contact;
  message.joint = fingertip ? simulation.hands().bone_of(fingertip->touched.body) : grip.bone;
  fill(message.position, simulation.held_pose(grip).position);
  fill(message.target, pointer.pose().position + grip.position_offset);
  fill(message.force, grip.force.force);
  fill(message.torque, grip.force.torque);
  const dynamics::BodyForce on_hand = pointer.force_on_hand();
  fill(message.hand_force, on_hand.force);
  fill(message.hand_torque, on_hand.torque);
  return message;
}

status_t make_status(const Simulation& simulation, std::int64_t server_id) {
  auto message = begin_message<status_t>(simulation, server_id);
  message.state = simulation.failure().empty() ? "running" : "failed";
  message.detail = simulation.failure();
  message.clock = clock_name(simulation.settings().clock);
  message.content_hash = content_hash(simulation.doll());
  message.steps = simulation.steps();
  const StepSummary summary = simulation.statistics().summary();
  message.step_us_p50 = summary.cpu_us_p50;
  message.step_us_p99 = summary.cpu_us_p99;
  message.step_us_max = summary.cpu_us_max;
  message.realtime_factor = summary.realtime_factor;
  message.yielding_joints = simulation.yielding_joints();
  const dynamics::Energy energy = simulation.energy();
  message.kinetic_energy = energy.kinetic;
  message.elastic_energy = energy.elastic;
  for (int k = 0; k < simulation.devices().count(); ++k) message.devices.push_back(make_device(simulation, k));
  message.device_count = simulation.devices().count();
  return message;
}

}  // namespace layfigure::app
