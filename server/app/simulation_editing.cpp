/// The changes of the doll that can be undone.
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "layfigure/app/simulation.h"
#include "layfigure/doll/joint_change.h"

namespace layfigure::app {
namespace {

constexpr double kSoon = 0.5;  // [s]: two hands that take hold together, or a slider that is drawn

}  // namespace

/// Takes note of what `action` does, unless it throws.
template <class Action>
void Simulation::edit(const std::string& label, Action&& action) {
  haptics::DollMemory before = hands_.memory();
  action();
  history_.begin(label, std::move(before));
  note_present_tools();
  resting_ = false;
}

bool Simulation::is_soon_after(std::int64_t step) const {
  return static_cast<double>(steps_ - step) <= kSoon * settings_.physics_hz;
}

bool Simulation::is_noted(int id, const Pointer& pointer) const {
  return std::ranges::find(tools_, NotedTool{id, pointer.tools_taken()}) != tools_.end();
}

void Simulation::note_present_tools() {
  tools_.clear();
  for (const auto& [id, pointer] : hands_.pointers()) {
    if (pointer.tool() != haptics::Tool::kNone) tools_.push_back({id, pointer.tools_taken()});
  }
}

/// A tool that has come out begins a step of the history. It has not moved the doll yet.
void Simulation::note_tools() {
  std::size_t out = 0;
  std::size_t noted = 0;
  int newest = -1;
  for (const auto& [id, pointer] : hands_.pointers()) {
    if (pointer.tool() == haptics::Tool::kNone) continue;
    ++out;
    if (is_noted(id, pointer)) {
      ++noted;
    } else {
      newest = id;
    }
  }
  if (noted == out && out == tools_.size()) return;  // as in almost every step: nothing is allocated
  note_present_tools();
  const bool together = noted > 0 && is_soon_after(tool_at_);
  if (newest < 0 || together) return;
  const Pointer& pointer = hands_.pointers().at(newest);
  const bool grabs = pointer.tool() == haptics::Tool::kGrab;
  history_.begin(grabs ? "grab " + doll().rig.bones[pointer.grip()->bone].name : "touch", hands_.memory());
  tool_at_ = steps_;
}

const haptics::Pin& Simulation::pin(const PinRequest& request) {
  edit("pin", [&] { hands_.pin(request); });
  return hands_.pins().all().back();
}

void Simulation::unpin(int id) {
  edit("unpin", [&] { hands_.unpin(id); });
}

void Simulation::unpin_all() {
  edit("unpin", [&] { hands_.unpin_all(); });
}

std::vector<int> Simulation::joints_of(const std::vector<int>& bones) const {
  std::vector<int> bodies;
  for (int bone = 0; bone < static_cast<int>(doll().rig.bones.size()); ++bone) {
    const int body = doll().body_of_bone[bone];
    if (body < 0 || doll().definition.bodies[body].parent < 0) continue;
    if (bones.empty() || std::ranges::find(bones, bone) != bones.end()) bodies.push_back(body);
  }
  if (!bones.empty() && bodies.empty()) hands_.require_joint(bones.front());
  return bodies;
}

void Simulation::set(const HandSettings& settings, const std::string& label) {
  if (settings.base) hands_.require_no_tool(settings.pointer);
  if (settings.magnet) hands_.require_fingertip(settings.pointer);
  if (settings.holds_rotation) hands_.require_grab(settings.pointer);
  const std::vector<int> bodies = joints_of(settings.bones);
  haptics::DollMemory before;
  if (settings.of_doll()) before = hands_.memory();
  if (settings.joint || settings.gravity) {
    std::vector<std::pair<int, dynamics::BodyDefinition>> joints;
    for (std::size_t k = 0; settings.joint && k < bodies.size(); ++k) {
      const int body = bodies[k];
      joints.emplace_back(body,
                          doll::changed_joint(*settings.joint, hands_.made(body), doll().definition.bodies[body]));
    }
    hands_.change(joints, settings.gravity);  // or throws, before anything has changed
  }
  if (settings.base) hands_.set_base(settings.pointer, *settings.base);
  if (settings.scale) hands_.set_scale(settings.pointer, *settings.scale);
  if (settings.power_scale) hands_.set_power_scale(settings.pointer, *settings.power_scale);
  if (settings.clutch) hands_.set_clutch(settings.pointer, *settings.clutch);
  if (settings.magnet) hands_.set_magnet(settings.pointer, *settings.magnet);
  if (settings.holds_rotation) {
    hands_.set_holds_rotation(settings.pointer, *settings.holds_rotation, settings.angular_stiffness);
  }
  if (settings.softness && settings.bones.empty()) hands_.set_softness(*settings.softness);
  if (settings.softness && !settings.bones.empty()) {
    for (const int body : bodies) hands_.set_softness(*settings.softness, doll().bone_of_body[body]);
  }
  resting_ = false;
  if (!settings.of_doll()) return;
  const bool same_slider = history_.label() == label && history_.at_end() && is_soon_after(set_at_);
  if (!same_slider) history_.begin(label, std::move(before));
  set_at_ = steps_;
}

void Simulation::lock(const std::vector<int>& bones, const std::array<bool, 3>& axes, bool locked,
                      const std::string& label) {
  const std::vector<int> bodies = joints_of(bones);
  edit(label, [&] { hands_.lock(bodies, axes, locked); });
}

void Simulation::load_pose(const haptics::PoseRequest& request) {
  if (hands_.pose_drives().active()) {
    hands_.load_pose(request);
    resting_ = false;
  } else {
    edit("load_pose", [&] { hands_.load_pose(request); });
  }
}

void Simulation::cancel_pose() {
  hands_.cancel_pose();
  resting_ = false;
}

void Simulation::recall(const haptics::DollMemory& memory) {
  hands_.recall(memory);
  hands_.set_time(time());
  yielding_joints_ = 0;
  resting_ = false;
  failure_.clear();
  tools_.clear();
}

void Simulation::reset(bool all) {
  edit(all ? "reset all" : "reset", [&] {
    if (all) hands_.recall(hands_.initial_memory());
    hands_.reset();
  });
  hands_.set_time(time());
  yielding_joints_ = 0;
  failure_.clear();
}

PutBack Simulation::undo() {
  if (history_.undoable() == 0) throw std::invalid_argument("there is nothing to undo");
  PutBack done{.label = history_.label(), .released = hands_.busy_pointers()};
  recall(history_.undo(hands_.memory())->memory);
  return done;
}

PutBack Simulation::redo(std::optional<std::size_t> branch) {
  const std::size_t branches = history_.branches().size();
  if (branches == 0) throw std::invalid_argument("there is nothing to do again");
  if (branch && *branch >= branches) {
    throw std::invalid_argument("there is no branch " + std::to_string(*branch) + ", expected 0 to " +
                                std::to_string(branches - 1));
  }
  std::vector<int> released = hands_.busy_pointers();
  session::History::Move move = *history_.redo(branch);
  recall(move.memory);
  return {.label = std::move(move.label), .released = std::move(released)};
}

PutBack Simulation::go_to_place(std::int64_t place) {
  if (!history_.has(place)) {
    throw std::invalid_argument("the history has no place " + std::to_string(place) +
                                ": there never was one, or it is forgotten");
  }
  if (place == history_.place()) return {.label = history_.label(), .released = {}};
  std::vector<int> released = hands_.busy_pointers();
  session::History::Move move = *history_.go(place, hands_.memory());
  recall(move.memory);
  return {.label = std::move(move.label), .released = std::move(released)};
}

PutBack Simulation::mirror(session::MirrorSide side, const std::string& label) {
  const haptics::DollMemory image = session::mirrored(doll(), hands_.memory(), side);
  PutBack done = put_back(image, label);
  hands_.settle_pins();
  return done;
}

PutBack Simulation::put_pose(std::span<const session::PosedJoint> joints, const std::string& label) {
  PutBack done = put_back(session::posed(doll(), hands_.memory(), joints), label);
  hands_.settle_pins();
  return done;
}

PutBack Simulation::put_back(const haptics::DollMemory& memory, const std::string& label) {
  PutBack done{.label = label, .released = hands_.busy_pointers()};
  edit(label, [&] { recall(memory); });
  return done;
}

}  // namespace layfigure::app
