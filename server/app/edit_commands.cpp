/// The commands of an editor of poses: locks, history, snapshots, mirror.
#include <algorithm>
#include <array>
#include <sstream>
#include <string>

#include "layfigure/app/arguments.h"
#include "layfigure/app/commands.h"
#include "layfigure/app/joint_results.h"
#include "layfigure/app/results.h"
#include "layfigure/doll/joint_change.h"

namespace layfigure::app {
namespace {

constexpr std::int64_t kMostPlaces = std::int64_t{1} << 53;  // every whole number up to it is a double
constexpr std::array<const char*, 3> kAxisNames{"twist", "bend_y", "bend_z"};

std::array<bool, 3> axes_argument(const Arguments& arguments) {
  const std::optional<std::string> text = arguments.text("axes");
  if (!text) return {true, true, true};
  std::array<bool, 3> axes{};
  std::istringstream words(*text);
  for (std::string word; words >> word;) {
    const auto* axis = std::ranges::find(kAxisNames, word);
    if (axis == kAxisNames.end()) {
      throw Refusal("argument 'axes' is '" + *text + "', expected some of twist bend_y bend_z");
    }
    axes[axis - kAxisNames.begin()] = true;
  }
  return axes;
}

session::MirrorSide side_argument(const Arguments& arguments) {
  const std::string side = arguments.text("side").value_or("both");
  if (side == "both") return session::MirrorSide::kBoth;
  if (side == "left") return session::MirrorSide::kLeft;
  if (side == "right") return session::MirrorSide::kRight;
  throw Refusal("argument 'side' is '" + side + "', expected both, left or right");
}

doll::JointChoice now(const doll::Doll& doll, int body) {
  const dynamics::BodyDefinition& definition = doll.definition.bodies[body];
  return {definition.joint, definition.limits};
}

std::string name_argument(const Arguments& arguments) {
  std::optional<std::string> name = arguments.text("name");
  if (!name) throw Refusal("snapshot needs the argument 'name'");
  if (name->size() <= session::Snapshots::kMostLetters) return *name;
  throw Refusal("argument 'name' has " + std::to_string(name->size()) + " letters, expected at most " +
                std::to_string(session::Snapshots::kMostLetters));
}

void add_text(reply_t& reply, const std::string& name, const std::string& text) {
  add_result(reply, name, {});
  reply.results.back().text = text;
}

}  // namespace

void CommandProcessor::lock(const command_t& command, reply_t& reply) { set_locks(command, reply, true); }

void CommandProcessor::unlock(const command_t& command, reply_t& reply) { set_locks(command, reply, false); }

void CommandProcessor::set_locks(const command_t& command, reply_t& reply, bool locked) {
  const Arguments arguments(command, {"bone", "axes"});
  const std::optional<std::string> bone = arguments.text("bone");
  if (!bone && locked) throw Refusal("lock needs the argument 'bone'");
  const std::array<bool, 3> axes = axes_argument(arguments);
  std::vector<int> bones;
  if (bone) bones = doll::bones_named(simulation_.doll().rig, *bone);
  simulation_.lock(bones, axes, locked, command.name + " " + bone.value_or("all"));
  add_result(reply, "joints", joints_named(bones));
}

/// The bones with a joint among these, or all.
std::vector<double> CommandProcessor::joints_named(const std::vector<int>& bones) const {
  std::vector<double> joints;
  for (const int body : simulation_.joints_of(bones)) {
    joints.push_back(static_cast<double>(simulation_.doll().bone_of_body[body]));
  }
  return joints;
}

void CommandProcessor::get_joints(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {"bone", "of"});
  const std::string of = arguments.text("of").value_or("now");
  if (of != "now" && of != "chosen") throw Refusal("argument 'of' is '" + of + "', expected now or chosen");
  const doll::Doll& doll = simulation_.doll();
  std::vector<int> bones;
  if (const std::optional<std::string> bone = arguments.text("bone")) bones = doll::bones_named(doll.rig, *bone);
  std::vector<doll::JointChoice> joints;
  for (const int body : simulation_.joints_of(bones)) {
    joints.push_back(of == "now" ? now(doll, body) : doll.chosen_joints[body]);
  }
  add_result(reply, "joints", joints_named(bones));
  add_joints(reply, joints);
}

void CommandProcessor::undo(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {});
  tell(simulation_.undo(), reply);
}

void CommandProcessor::redo(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {"branch"});
  const std::optional<std::int64_t> branch =
      arguments.integer("branch", 0, static_cast<std::int64_t>(session::History::kMaxSteps));
  tell(simulation_.redo(branch ? std::optional(static_cast<std::size_t>(*branch)) : std::nullopt), reply);
}

void CommandProcessor::history(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {"action", "place"});
  const std::string action = arguments.text("action").value_or("state");
  const std::optional<std::int64_t> place = arguments.integer("place", 0, kMostPlaces);
  if (action == "state") {
    if (place) throw Refusal("argument 'place' does not go with state");
    tell_place(simulation_.history().label(), reply);
  } else if (action == "go") {
    if (!place) throw Refusal("history needs the argument 'place' to go to");
    tell(simulation_.go_to_place(*place), reply);
  } else {
    throw Refusal("argument 'action' is '" + action + "', expected state or go");
  }
}

void CommandProcessor::mirror(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {"side"});
  tell(simulation_.mirror(side_argument(arguments), "mirror"), reply);
}

void CommandProcessor::snapshot(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {"name", "action"});
  const std::string action = arguments.text("action").value_or("save");
  try {
    if (action == "list") {
      if (arguments.has("name")) throw Refusal("argument 'name' does not go with list");
      for (const std::string& name : snapshots_.names()) add_text(reply, "name", name);
    } else if (action == "save") {
      snapshots_.save(name_argument(arguments), simulation_.hands().memory());
    } else if (action == "restore") {
      const std::string name = name_argument(arguments);
      const std::optional<haptics::DollMemory> memory = snapshots_.find(name);
      if (!memory) throw Refusal("there is no snapshot '" + name + "'");
      tell(simulation_.put_back(*memory, "snapshot " + name), reply);
    } else if (action == "remove") {
      const std::string name = name_argument(arguments);
      if (!snapshots_.remove(name)) throw Refusal("there is no snapshot '" + name + "'");
    } else {
      throw Refusal("argument 'action' is '" + action + "', expected save, restore, remove or list");
    }
  } catch (const session::SnapshotError& error) {
    throw Refusal(error.what());
  }
}

/// The doll is another one, for all who look on, and hands hold it no more.
void CommandProcessor::tell(const PutBack& done, reply_t& reply) {
  publish_character();
  tell_place(done.label, reply);
  if (done.released.empty()) return;
  add_result(reply, "released", {done.released.begin(), done.released.end()});
}

/// Where the doll is in its history.
void CommandProcessor::tell_place(const std::string& label, reply_t& reply) const {
  const session::History& history = simulation_.history();
  add_text(reply, "label", label);
  add_result(reply, "steps", {static_cast<double>(history.undoable())});
  add_result(reply, "branches", {static_cast<double>(history.branches().size())});
  add_result(reply, "place", {static_cast<double>(history.place())});
}

}  // namespace layfigure::app
