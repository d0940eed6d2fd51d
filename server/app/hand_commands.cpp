/// The commands of hands: what pointers and pins do to the doll.
#include <limits>
#include <string>

#include "layfigure/app/arguments.h"
#include "layfigure/app/commands.h"
#include "layfigure/app/joint_arguments.h"
#include "layfigure/app/results.h"
#include "layfigure/doll/joint_change.h"
#include "layfigure/messaging/protocol.h"

namespace layfigure::app {
namespace {

constexpr double kMaxGain = 1e9;                // [N/m], [N s/m]
constexpr double kMinAngularStiffness = 1e-12;  // [N m/rad], so that what is held as 6-DOF is told from 3-DOF
constexpr double kMaxOffset = 1e3;              // [m] of a held point from its bone
constexpr double kMaxDistance = 1e6;            // [m] in the world, as of a pointer
constexpr double kMaxGravity = 1e4;             // [m/s^2]
constexpr std::int64_t kMaxPinId = std::numeric_limits<int>::max();

int pointer_argument(const Arguments& arguments) {
  return static_cast<int>(arguments.integer("pointer", 0, messaging::kMaxPointers - 1).value_or(0));
}

bool choice_argument(const Arguments& arguments, const std::string& name, const std::string& no,
                     const std::string& yes) {
  const std::string choice = arguments.text(name).value_or(no);
  if (choice != no && choice != yes) {
    throw Refusal("argument '" + name + "' is '" + choice + "', expected " + no + " or " + yes);
  }
  return choice == yes;
}

bool holds_rotation(const Arguments& arguments) { return choice_argument(arguments, "mode", "3dof", "6dof"); }

std::optional<double> gain_argument(const Arguments& arguments, std::string_view name) {
  return arguments.number(name, 0.0, kMaxGain);
}

/// Of a 6-DOF grip.
std::optional<double> angular_stiffness_argument(const Arguments& arguments, bool holds_rotation) {
  const std::optional<double> given = arguments.number("angular_stiffness", kMinAngularStiffness, kMaxGain);
  if (given && !holds_rotation) throw Refusal("argument 'angular_stiffness' needs mode 6dof");
  return given;
}

std::optional<PointerPose> pose_argument(const Arguments& arguments, std::string_view name) {
  const std::span<const double> given = arguments.numbers(name, 7, kMaxDistance);
  if (given.empty()) return std::nullopt;
  const std::optional<Eigen::Quaterniond> rotation = unit_quaternion(given.subspan<3, 4>());
  if (!rotation) {
    throw Refusal("argument '" + std::string(name) +
                  "' has a rotation that is no unit quaternion, expected x y z w x y z");
  }
  return PointerPose{.position = {given[0], given[1], given[2]}, .rotation = *rotation};
}

std::vector<double> to_vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

std::vector<double> to_vector(const PointerPose& pose) {
  const Eigen::Vector3d& p = pose.position;
  const Eigen::Quaterniond& q = pose.rotation;
  return {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()};
}

/// "set stiffness, damping of *Arm"
std::string set_label(const command_t& command) {
  std::string names;
  std::string bone;
  for (const argument_t& argument : command.arguments) {
    if (argument.name == "bone") {
      bone = " of " + argument.text;
    } else {
      names += (names.empty() ? " " : ", ") + argument.name;
    }
  }
  return "set" + names + bone;
}

/// Arguments that only go with some other one.
void refuse_if_given(const Arguments& arguments, std::initializer_list<std::string_view> names,
                     const std::string& reason) {
  for (const std::string_view name : names) {
    if (arguments.has(name)) throw Refusal("argument '" + std::string(name) + "' " + reason);
  }
}

}  // namespace

void CommandProcessor::grab(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {"pointer", "bone", "point", "stiffness", "damping", "mode", "angular_stiffness",
                                      "reach", "origin", "direction"});
  GrabRequest request;
  request.pointer = pointer_argument(arguments);
  request.stiffness = gain_argument(arguments, "stiffness");
  request.damping = gain_argument(arguments, "damping");
  request.holds_rotation = holds_rotation(arguments);
  request.angular_stiffness = angular_stiffness_argument(arguments, request.holds_rotation);
  std::optional<double> distance;
  if (const std::optional<std::string> bone = arguments.text("bone")) {
    refuse_if_given(arguments, {"reach", "origin", "direction"}, "is for a grab without 'bone'");
    request.bone = find_bone(*bone);
    request.point = arguments.vector("point", kMaxOffset);
  } else {
    const skinning::SkinPoint there = what_is_there(arguments, request.pointer);
    request.bone = there.bone;
    request.point = there.p_BS;
    distance = there.distance;
  }
  const Eigen::Vector3d held = simulation_.grab(request);
  const Pointer& pointer = simulation_.pointers().at(request.pointer);
  const dynamics::Coupling& coupling = pointer.grip()->coupling;
  const Eigen::Isometry3d& X_BA = simulation_.doll().carriers[request.bone].pose;
  add_result(reply, "joint", {static_cast<double>(request.bone)});
  add_result(reply, "position", to_vector(held));
  add_result(reply, "point", to_vector(X_BA.inverse() * coupling.point));
  add_result(reply, "pointer", to_vector(pointer.pose()));
  add_result(reply, "stiffness", {coupling.stiffness});
  add_result(reply, "damping", {coupling.damping});
  if (distance) add_result(reply, "distance", {*distance});
}

/// The skin at the pointer, or where the ray of the arguments meets it.
skinning::SkinPoint CommandProcessor::what_is_there(const Arguments& arguments, int pointer) {
  refuse_if_given(arguments, {"point"}, "needs the argument 'bone'");
  const std::optional<Eigen::Vector3d> origin = arguments.vector("origin", kMaxDistance);
  const std::optional<Eigen::Vector3d> direction = arguments.vector("direction", kMaxDistance);
  if (!origin && !direction) {
    return simulation_.skin_near(pointer, arguments.number("reach", 0.0, kMaxOffset).value_or(haptics::kGrabReach));
  }
  refuse_if_given(arguments, {"reach"}, "does not go with a ray");
  if (!origin || !direction) throw Refusal("a ray needs both arguments 'origin' and 'direction'");
  if (direction->isZero(0.0)) throw Refusal("argument 'direction' is zero");
  return simulation_.skin_along(*origin, *direction);
}

void CommandProcessor::touch(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {"pointer", "radius", "friction", "stiffness", "damping", "magnet"});
  TouchRequest request;
  request.pointer = pointer_argument(arguments);
  request.fingertip.radius = arguments.number("radius", haptics::kMinFingertipRadius, haptics::kMaxFingertipRadius)
                                 .value_or(haptics::kFingertipRadius);
  request.fingertip.friction =
      arguments.number("friction", 0.0, haptics::kMaxFriction).value_or(haptics::kFingertipFriction);
  request.fingertip.magnet = arguments.flag("magnet").value_or(false);
  request.stiffness = gain_argument(arguments, "stiffness");
  request.damping = gain_argument(arguments, "damping");
  simulation_.touch(request);
  const Pointer& pointer = simulation_.pointers().at(request.pointer);
  add_result(reply, "position", to_vector(pointer.pose().position));
  add_result(reply, "radius", {request.fingertip.radius});
  add_result(reply, "stiffness", {pointer.grip()->coupling.stiffness});
  add_result(reply, "damping", {pointer.grip()->coupling.damping});
}

void CommandProcessor::release(const command_t& command, reply_t&) {
  const Arguments arguments(command, {"pointer"});
  simulation_.release(pointer_argument(arguments));
}

void CommandProcessor::pin(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {"bone", "point", "mode", "hold", "action"});
  if (choice_argument(arguments, "action", "add", "list")) {
    refuse_if_given(arguments, {"bone", "point", "mode", "hold"}, "does not go with list");
    return list_pins(reply);
  }
  const std::optional<std::string> bone = arguments.text("bone");
  if (!bone) throw Refusal("pin needs the argument 'bone'");
  PinRequest request;
  request.bone = find_bone(*bone);
  request.point = arguments.vector("point", kMaxOffset);
  request.holds_rotation = holds_rotation(arguments);
  request.rigid = choice_argument(arguments, "hold", "stiff", "rigid");
  const haptics::Pin& pin = simulation_.pin(request);
  add_result(reply, "pin", {static_cast<double>(pin.id)});
  add_result(reply, "joint", {static_cast<double>(pin.bone)});
  add_result(reply, "position", to_vector(pin.position));
}

void CommandProcessor::list_pins(reply_t& reply) const {
  std::vector<double> ids;
  std::vector<double> joints;
  std::vector<double> positions;
  for (const haptics::Pin& pin : simulation_.hands().pins().all()) {
    ids.push_back(static_cast<double>(pin.id));
    joints.push_back(static_cast<double>(pin.bone));
    positions.insert(positions.end(), pin.position.begin(), pin.position.end());
  }
  add_result(reply, "pin", std::move(ids));
  add_result(reply, "joint", std::move(joints));
  add_result(reply, "position", std::move(positions));
}

void CommandProcessor::unpin(const command_t& command, reply_t&) {
  const Arguments arguments(command, {"pin"});
  if (const std::optional<std::int64_t> id = arguments.integer("pin", 1, kMaxPinId)) {
    simulation_.unpin(static_cast<int>(*id));
  } else {
    simulation_.unpin_all();
  }
}

void CommandProcessor::set(const command_t& command, reply_t& reply) {
  std::vector<std::string_view> names{"pointer",  "scale",  "power_scale", "clutch",
                                      "base",     "magnet", "mode",        "angular_stiffness",
                                      "softness", "bone",   "gravity"};
  names.insert(names.end(), joint_argument_names().begin(), joint_argument_names().end());
  const Arguments arguments(command, names);
  HandSettings settings;
  settings.scale = arguments.number("scale", haptics::kMinScale, haptics::kMaxScale);
  settings.power_scale = arguments.number("power_scale", haptics::kMinPowerScale, haptics::kMaxPowerScale);
  settings.clutch = arguments.flag("clutch");
  settings.base = pose_argument(arguments, "base");
  settings.magnet = arguments.flag("magnet");
  if (arguments.has("mode")) settings.holds_rotation = holds_rotation(arguments);
  settings.angular_stiffness = angular_stiffness_argument(arguments, settings.holds_rotation.value_or(false));
  settings.softness = arguments.number("softness", 0.0, haptics::kMaxSoftness);
  settings.gravity = arguments.vector("gravity", kMaxGravity);
  settings.joint = joint_arguments(arguments);
  const bool of_pointer = settings.scale || settings.power_scale || settings.clutch || settings.base ||
                          settings.magnet || settings.holds_rotation;
  if (!of_pointer && !settings.of_doll()) {
    throw Refusal(
        "set needs something to set: scale, power_scale, clutch, base, magnet, mode, softness, gravity, or of joints "
        "stiffness, damping, flow_damping, yield_torque, hardening or limits");
  }
  if (!of_pointer) refuse_if_given(arguments, {"pointer"}, "does not go with what is the doll's");
  settings.pointer = pointer_argument(arguments);
  if (const std::optional<std::string> bone = arguments.text("bone")) {
    if (!settings.softness && !settings.joint) throw Refusal("argument 'bone' needs something to set of its joint");
    settings.bones = doll::bones_named(simulation_.doll().rig, *bone);
  }
  simulation_.set(settings, set_label(command));
  if (settings.joint || settings.gravity) publish_character();
  if (settings.joint) add_result(reply, "joints", joints_named(settings.bones));
}

}  // namespace layfigure::app
