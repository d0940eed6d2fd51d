#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "layfigure/doll/doll.h"
#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/haptics/doll_memory.h"
#include "layfigure/haptics/haptic_loop.h"
#include "layfigure/haptics/local_model.h"
#include "layfigure/haptics/pins.h"
#include "layfigure/haptics/pointer.h"
#include "layfigure/haptics/pose_drives.h"
#include "layfigure/haptics/softness.h"
#include "layfigure/haptics/touch_scene.h"
#include "layfigure/skinning/posed_skin.h"

namespace layfigure::haptics {

/// How far from the skin a pointer grabs it unless told otherwise [m]: about a finger's and a half.
inline constexpr double kGrabReach = 0.03;

/// A wish to hold a bone.
struct GrabRequest {
  int pointer{0};
  int bone{0};
  std::optional<Eigen::Vector3d> point{};     ///< in the bone's frame [m]; default: the com of its body, or the bone's
                                              ///< origin if it rides on another's body
  std::optional<double> stiffness{};          ///< [N/m], > 0; default: see Hands::grab
  std::optional<double> damping{};            ///< [N s/m], >= 0; default: see Hands::grab
  bool holds_rotation{false};                 ///< 6-DOF: the rotation is held too
  std::optional<double> angular_stiffness{};  ///< [N m/rad], > 0, of a 6-DOF grip; default: see Hands::grab
};

/// A wish to touch.
struct TouchRequest {
  int pointer{0};
  FingertipDefinition fingertip{};
  std::optional<double> stiffness{};  ///< [N/m], > 0; default: see Hands::touch
  std::optional<double> damping{};    ///< [N s/m], >= 0; default: see Hands::touch
};

/// A doll in a scene and all that hands do to it: pointers, each with at most one tool, pins, and softness.
///
/// The tools: a grab pulls at a point of a bone by a virtual coupling. Touch puts a fingertip into the scene, a body of
/// its own that a coupling holds to the pointer: it pushes with contact and friction, and two of them pinch. A pointer
/// whose client has gone keeps its last pose and its tool: letting go by itself could drop the doll, holding still
/// cannot. Another client may release it.
///
/// Single-threaded; knows no messages and no clock. What throws std::invalid_argument, with one line that says why, has
/// changed nothing. step() throws, locks and logs nothing, and allocates only where there are more contacts than ever
/// before, or where a magnet takes hold.
class Hands {
 public:
  /// Steps of `step` [s]. Skins the doll: O(n log n) in its triangles.
  Hands(doll::Doll doll, double step);

  [[nodiscard]] const doll::Doll& doll() const { return doll_; }
  [[nodiscard]] double step_length() const { return h_; }
  /// The doll's bodies first; then the fingertips that are out.
  [[nodiscard]] const dynamics::Model& model() const { return touch_.model(); }
  [[nodiscard]] const dynamics::State& state() const { return touch_.state(); }
  [[nodiscard]] const std::map<int, Pointer>& pointers() const { return pointers_; }
  [[nodiscard]] const Pins& pins() const { return pins_; }
  [[nodiscard]] const Softness& softness() const { return softness_; }
  void set_time(double time) { touch_.state().time = time; }
  /// Of a grab or touch that names none [N/m], see grab().
  [[nodiscard]] double default_stiffness() const;

  /// Where the hand of pointer `id` is to be.
  void receive(int id, const PointerPose& hand) { pointers_[id].receive(hand); }
  /// The pointer, or all of them, glide to their newest poses over the next `steps` steps, > 0.
  void glide(int id, std::int64_t steps) { pointers_.at(id).glide(steps); }
  void glide(std::int64_t steps);
  /// The pointer of a device is at its newest pose, see Pointer::follow().
  void follow(int id) { pointers_.at(id).follow(h_); }

  /// Holds a bone with a virtual coupling. Nothing jumps: the pointer's pose now corresponds to the held point as it is
  /// now. Defaults: stiffness k = m (2 pi 3 Hz)^2 with the doll's whole mass m, so that the doll hangs from the pointer
  /// 28 mm low; damping = 2 sqrt(k m), critical for the whole doll. A 6-DOF grip turns with r^2 times these, r the held
  /// body's radius of gyration; an angular stiffness of its own has damping in the same ratio. Throws if the pointer
  /// has a tool already or the bone cannot be held. Returns the held point, world.
  Eigen::Vector3d grab(const GrabRequest& request);

  /// The skin's point that is nearest to the pointer, for a grab. Throws if the pointer has no pose yet, or if there is
  /// none within `reach` [m]. O(n) in the vertices, as PosedSkin::pose().
  [[nodiscard]] skinning::SkinPoint skin_near(int pointer, double reach);
  /// Where a ray, of a mouse, first meets the skin. Throws if it meets none.
  [[nodiscard]] skinning::SkinPoint skin_along(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

  /// Puts the pointer's fingertip into the scene, where the pointer is. Defaults: the stiffness of a grab, and damping
  /// that is critical for a tenth of the doll, as much as a limb: 2 sqrt(k m / 10). Throws if the pointer has a tool
  /// already or no pose yet, or if the fingertip would begin inside something.
  void touch(const TouchRequest& request);

  /// Puts the pointer's tool away. Throws if it has none.
  void release(int pointer);

  /// Throws if no body carries the bone.
  const Pin& pin(const PinRequest& request);
  /// Throws if there is no pin of that id.
  void unpin(int id);
  void unpin_all();

  /// While any pointer has a tool out. `factor` of the yield torques, in [0, kMaxSoftness].
  void set_softness(double factor);
  /// Of the joint of one bone. Throws if the bone has none.
  void set_softness(double factor, int bone);

  void set_scale(int pointer, double scale) { pointers_[pointer].set_scale(scale); }
  void set_clutch(int pointer, bool held) { pointers_[pointer].set_clutch(held); }
  void set_power_scale(int pointer, double scale) { pointers_[pointer].set_power_scale(scale); }
  /// A grip holds the bone's rotation from now on as it is now, with gains as in grab(), or no more; nothing jumps.
  /// Throws if the pointer does not grab.
  void set_holds_rotation(int pointer, bool holds, const std::optional<double>& angular_stiffness = {});
  /// Throws if the pointer has a tool out.
  void set_base(int pointer, const PointerPose& base);
  /// The pointer, which has no tool out, is at `world` where its hand is now.
  void place(int pointer, const PointerPose& world) { pointers_[pointer].place(world); }

  /// A fingertip with a magnet sticks to the first body of the doll that it touches, by a rigid tie of unlimited force
  /// that holds translation and rotation: it never drops what it holds by accident. It lets go when the magnet is
  /// turned off or the tool put away, by nothing else. Throws if the pointer is not touching.
  void set_magnet(int pointer, bool on);

  /// Throw what the setters of the same name would throw.
  void require_no_tool(int pointer) const;
  void require_grab(int pointer) const;
  void require_fingertip(int pointer) const;
  void require_joint(int bone) const;

  /// The initial pose at rest; all tools put away, all pins gone. What was set stays: softness, joints, gravity, and
  /// the pointers' maps.
  void reset();

  /// The joint behind a body as the doll was made, whatever was set since.
  [[nodiscard]] const dynamics::BodyDefinition& made(int body) const { return made_.bodies[body]; }

  /// The joints behind these bodies have these laws and limits from now on, and the doll this gravity [m/s^2]. Throws
  /// what Model would throw. Makes the scene anew: O(n) and the hulls' topology, allocates.
  void change(const std::vector<std::pair<int, dynamics::BodyDefinition>>& joints,
              const std::optional<Eigen::Vector3d>& gravity);
  /// These axes (twist, bend y, bend z) of the joints behind these bodies turn no more, or again. A joint stays where
  /// it is when it is locked: its strain about the locked axes is put aside, and given back when they are unlocked. As
  /// change() beside it.
  void lock(const std::vector<int>& bodies, const std::array<bool, 3>& axes, bool locked);

  /// Turns joints, see PoseDrives. Throws if one of the bodies has no joint that can turn.
  void load_pose(const PoseRequest& request);
  /// Joints stay where they are.
  void cancel_pose();
  [[nodiscard]] const PoseDrives& pose_drives() const { return drives_; }

  /// The doll as it is now. O(n), allocates.
  [[nodiscard]] DollMemory memory() const;
  /// The doll as it was made.
  [[nodiscard]] const DollMemory& initial_memory() const { return initial_; }
  /// The doll is as it was then, at rest, bit for bit; all tools put away. Throws std::invalid_argument if the memory
  /// is none of this doll's. As change() beside it.
  void recall(const DollMemory& memory);
  /// Pins hold what they hold where it is now.
  void settle_pins() { pins_.settle(model(), state()); }
  /// The pointers that have a tool out.
  [[nodiscard]] std::vector<int> busy_pointers() const;

  /// Pointers 0 to `count` - 1, at most kMostPointers, are those of devices that are served at the haptic rate: the
  /// steps leave their tools to local dynamics (haptic_loop.h), whose wrenches take() brings. A fingertip that a magnet
  /// holds is held by the step, and its coupling alone is local.
  void serve(int count);
  /// What the served tools did until now: acts in the next step.
  void take(const HapticReport& report);
  /// The local model of the step to come: makes a trial step. False where there is none, see LocalModeler::make().
  [[nodiscard]] bool make_local_model(double tick, LocalModel& model);

  /// One step. What it reports as not kOk has left the state as it was.
  [[nodiscard]] dynamics::StepReport step();

  /// Where the held point is, with the rotation of the body that it belongs to. O(bodies).
  [[nodiscard]] PointerPose held_pose(const Grip& grip) const;
  /// The bone of a body of the doll; -1 for another.
  [[nodiscard]] int bone_of(int body) const;

 private:
  /// The fingertips' weight, and what acts on ports.
  struct StepLoads : dynamics::Loads {
    void add(double time, std::span<dynamics::BodyForce> forces) const override;
    const dynamics::Loads* weights{nullptr};
    PortLoads ports;
  };

  void pin_roots();
  void adopt(dynamics::ModelDefinition definition);
  void put_tools_away();
  void forget_drives();
  void hand_over_to_springs();
  void collect_inputs();
  void finish_step();
  [[nodiscard]] TipMotion tip_motion(const Pointer& pointer) const;
  void observe_contacts();
  void form_bonds();
  void let_bonds_through();
  void leave_to_local_dynamics();
  void place_fingertips(std::optional<std::pair<int, FingertipDefinition>> coming);
  void tools_changed();
  [[nodiscard]] bool any_tool() const;
  [[nodiscard]] dynamics::Coupling make_coupling(const GrabRequest& request) const;
  void hold_rotation(dynamics::Coupling& coupling, const std::optional<double>& angular_stiffness) const;
  void pose_skin();
  [[nodiscard]] bool is_served(int pointer) const { return pointer < served_; }
  [[nodiscard]] bool any_served_tool() const;
  [[nodiscard]] bool is_local(int pointer) const;
  [[nodiscard]] dynamics::StepReport make_step(dynamics::State& state);
  void collect_ports();
  void keep_known_loads();
  void put_local_fingertips();

  doll::Doll doll_;                             ///< its definition has the present laws, limits and gravity
  dynamics::ModelDefinition made_;              ///< as the doll came
  std::vector<Eigen::Vector3d> locked_strain_;  ///< one per body, see lock(); section axes [rad]
  double h_;
  TouchScene touch_;
  double total_mass_;  ///< of the doll [kg]
  std::vector<dynamics::Coupling> root_pins_;
  Pins pins_;
  Softness softness_;
  PoseDrives drives_;
  std::map<int, Pointer> pointers_;
  skinning::PosedSkin skin_;
  doll::SkeletonPose skeleton_;
  DollMemory initial_;

  // of what is served at the haptic rate
  int served_{0};
  std::optional<LocalModeler> modeler_;  ///< of the present scene
  std::vector<PortLoad> loads_;          ///< of the newest report
  std::array<ServedTool, kMostPointers> tools_;
  std::vector<PointerPort> ports_;
  StepLoads step_loads_;
  dynamics::State trial_;

  // of the step at hand
  std::vector<dynamics::Coupling> couplings_;  ///< the roots' and other pins, then the grips in the order of pointers
  std::vector<dynamics::Tie> ties_;            ///< rigid pins, then bonds in the order of pointers
  std::vector<dynamics::BodyPose> poses_;
  std::size_t first_grip_{0};
  std::size_t first_bond_{0};
};

}  // namespace layfigure::haptics
