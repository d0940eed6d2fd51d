#include "message_target.h"

#include <optional>
#include <type_traits>
#include <variant>

#include "layfigure/app/messages.h"
#include "small_doll.h"

namespace layfigure::fuzz {
namespace {

constexpr std::int64_t kServerId = 77;

/// A number's own bytes: -0 and nan count as what they are.
template <class Value>
void append(std::string& out, const Value& value) {
  static_assert(std::is_arithmetic_v<Value>);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class Matrix>
void append_numbers(std::string& out, const Matrix& matrix) {
  for (Eigen::Index i = 0; i < matrix.size(); ++i) append(out, matrix.data()[i]);
}

void append(std::string& out, const Eigen::Vector3d& v) { append_numbers(out, v); }
void append(std::string& out, const Eigen::Quaterniond& q) { append_numbers(out, q.coeffs()); }

void append(std::string& out, const dynamics::BodyState& body) {
  for (const auto& q : {body.rotation, body.rest_rotation}) append(out, q);
  for (const auto& v : {body.linear_momentum, body.angular_momentum, body.trial_torque, body.torque, body.position}) {
    append(out, v);
  }
  for (const double x : {body.flow, body.yield_scale, body.limit_slack, body.rest_time}) append(out, x);
  append(out, body.yielding);
  append(out, body.asleep);
}

void append(std::string& out, const dynamics::BodyDefinition& body) {
  const dynamics::JointLaw& law = body.joint;
  for (const double x : {law.stiffness, law.damping, law.flow_damping, law.yield_torque, law.hardening}) append(out, x);
  for (const auto& v : {law.shape.stiffness, law.shape.damping, law.shape.yield}) append(out, v);
  for (const bool locked : law.shape.locked) append(out, locked);
  append(out, body.limits.twist_lower);
  append(out, body.limits.twist_upper);
  for (const double x : body.limits.swing_lower) append(out, x);
  for (const double x : body.limits.swing_upper) append(out, x);
}

void append(std::string& out, const dynamics::State& state) {
  append(out, state.time);
  for (const dynamics::BodyState& body : state.bodies) append(out, body);
  for (const dynamics::ConstraintMemory& memory : state.constraints) {
    append(out, memory.key);
    append(out, memory.force);
  }
  append(out, state.rest.resting);
  append(out, state.rest.inputs);
  append(out, state.rest.contacts);
}

template <class Message>
void append_message(std::string& out, const Message& message) {
  const messaging::Bytes bytes = messaging::encode(message);
  out.append(bytes.begin(), bytes.end());
}

void append(std::string& out, const haptics::Pin& pin) {
  append(out, pin.id);
  append(out, pin.bone);
}

void append(std::string& out, const app::Pointer& pointer) {
  append(out, pointer.pose().position);
  append(out, pointer.pose().rotation);
  append(out, pointer.has_pose());
  append(out, static_cast<int>(pointer.tool()));
  append(out, pointer.map().scale());
  append(out, pointer.map().power_scale());
  append(out, pointer.map().clutched());
  const app::PointerPose in_device = pointer.map().to_device({});  // tells the base
  append(out, in_device.position);
  append(out, in_device.rotation);
  if (pointer.fingertip()) append(out, pointer.fingertip()->definition.magnet);
  if (!pointer.grip()) return;
  append(out, pointer.grip()->coupling.stiffness);
  append(out, pointer.grip()->coupling.damping);
  append(out, pointer.grip()->coupling.point);
}

}  // namespace

MessageTarget::MessageTarget()
    : simulation_(testing::small_doll(), {.clock = app::ClockKind::kLockstep}),
      poses_(simulation_, sink_, kServerId),
      snapshots_(simulation_.doll(), {}),
      commands_(simulation_, poses_, sink_, snapshots_, kServerId) {
  poses_.publish_if_due();
  state_ = fingerprint();
}

std::string MessageTarget::receive_command(messaging::ByteView bytes) {
  inbox().receive_command(bytes);
  return handle_events();
}

std::string MessageTarget::receive_pointer(messaging::ByteView bytes) {
  inbox().receive_pointer(bytes);
  return handle_events();
}

messaging::Inbox& MessageTarget::inbox() {
  constexpr int kMostMessages = 10'000;  // far below the burst that an inbox takes
  if (!inbox_ || ++received_ > kMostMessages) {
    inbox_.emplace(kServerId);
    received_ = 0;
  }
  return *inbox_;
}

std::string MessageTarget::handle_events() {
  const std::vector<messaging::Inbox::Event> events = inbox_->take();
  if (events.empty()) ++tally_.bad;
  for (const messaging::Inbox::Event& event : events) {
    std::string wrong = std::visit([this](const auto& message) { return handle(message); }, event);
    if (!wrong.empty()) return wrong;
  }
  return {};
}

std::string MessageTarget::handle(const command_t& command) {
  const std::int64_t replies = sink_.replies;
  commands_.handle(command);
  while (commands_.is_sending_mesh()) commands_.send_mesh_chunk();
  if (sink_.replies != replies + 1) {
    return "'" + command.name + "' got " + std::to_string(sink_.replies - replies) + " replies";
  }
  const reply_t& reply = sink_.reply;
  if (reply.client_id != command.client_id || reply.sequence != command.sequence)
    return "the reply is to another command";
  if ((reply.accepted != 0) != reply.reason.empty()) return "refused without a reason, or accepted with one";
  if (reply.reason.find('\n') != std::string::npos) return "the reason is more than a line: " + reply.reason;
  std::string state = fingerprint();
  if (reply.accepted == 0 && state != state_)
    return "'" + command.name + "' was refused (" + reply.reason + "), and changed the state";
  state_ = std::move(state);
  ++(reply.accepted != 0 ? tally_.accepted : tally_.refused);
  return {};
}

std::string MessageTarget::handle(const pointer_t& pointer) {
  const auto& [x, y, z] = pointer.position;
  const auto& [qw, qx, qy, qz] = pointer.rotation;
  simulation_.point(pointer.pointer, {{x, y, z}, Eigen::Quaterniond(qw, qx, qy, qz).normalized()}, pointer.client_id,
                    pointer.sequence);
  state_ = fingerprint();
  ++tally_.pointers;
  return {};
}

std::string MessageTarget::fingerprint() {
  std::string out;
  append(out, simulation_.steps());
  append(out, simulation_.state());
  append(out, simulation_.yielding_joints());
  append(out, simulation_.doll().definition.gravity);
  append(out, simulation_.history().place());
  append(out, simulation_.hands().pose_drives().count());
  for (std::size_t body = 0; body < simulation_.doll().definition.bodies.size(); ++body) {
    append(out, simulation_.doll().definition.bodies[body]);
    append(out, simulation_.hands().softness().factor(static_cast<int>(body)));
  }
  append(out, simulation_.failure().size());
  for (const haptics::Pin& pin : simulation_.hands().pins().all()) append(out, pin);
  for (const auto& [id, pointer] : simulation_.pointers()) {
    append(out, pointer);
    append_message(out, app::make_force(simulation_, kServerId, 0, id, pointer));
  }
  for (const auto& [id, input] : simulation_.inputs()) {
    append(out, id);
    append(out, input.sequence());
    out += input.client_id();
  }
  return out;
}

}  // namespace layfigure::fuzz
