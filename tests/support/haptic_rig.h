#pragma once

#include <functional>
#include <span>
#include <vector>

#include "layfigure/haptics/local_dynamics.h"
#include "layfigure/haptics/local_model.h"
#include "layfigure/scene/scene.h"

/// Hands on a doll, served at the haptic rate by local dynamics between physics steps, or by whole steps.
namespace layfigure::testing {

/// Where a pointer's device wants it at a time.
using Hand = std::function<haptics::CouplingTarget(double time)>;

class HapticRig {
 public:
  virtual ~HapticRig() = default;
  /// One haptic tick, towards the targets of the hands at its beginning; what each hand feels.
  virtual std::span<const haptics::PortWrench> tick(std::span<const Hand> hands) = 0;
  [[nodiscard]] virtual double time() const = 0;
  [[nodiscard]] virtual const dynamics::State& state() const = 0;
};

/// A doll that hands hold or touch.
struct HeldScene {
  scene::SceneDefinition definition;
  dynamics::State start;
  std::vector<haptics::PointerPort> pointers;
  std::vector<dynamics::Coupling> pins{};  ///< what holds the doll itself
};

/// The whole doll stepped in every tick, the couplings a part of the step.
class FullRig : public HapticRig {
 public:
  FullRig(HeldScene held, double haptic_hz);
  std::span<const haptics::PortWrench> tick(std::span<const Hand> hands) override;
  [[nodiscard]] double time() const override { return static_cast<double>(ticks_) * h_; }
  [[nodiscard]] const dynamics::State& state() const override { return state_; }
  [[nodiscard]] const dynamics::StepReport& report() const { return report_; }

 private:
  HeldScene held_;
  scene::Scene scene_;
  dynamics::State state_;
  double h_;
  long ticks_{0};
  std::vector<dynamics::Coupling> couplings_;
  std::vector<haptics::PortWrench> felt_;
  dynamics::StepReport report_;
};

/// Physics steps of whole multiples of the tick, local dynamics between them.
class MultirateRig : public HapticRig {
 public:
  MultirateRig(HeldScene held, double physics_hz, double haptic_hz);
  std::span<const haptics::PortWrench> tick(std::span<const Hand> hands) override;
  [[nodiscard]] double time() const override { return static_cast<double>(ticks_) * h_; }
  [[nodiscard]] const dynamics::State& state() const override { return state_; }
  [[nodiscard]] const haptics::LocalDynamics& local() const { return local_; }
  [[nodiscard]] const haptics::LocalModel& model() const { return model_; }
  [[nodiscard]] long failed_steps() const { return failed_; }
  /// From now on steps' own losses are measured, which allocates.
  void measure_losses() { measures_losses_ = true; }
  /// Of the last step, by its ledger (dynamics::Work): the work that it was done less the energy that it gained and
  /// what its joints and constraints took, and what rounding may have made of that [J].
  [[nodiscard]] double step_loss() const { return step_loss_; }
  [[nodiscard]] double step_rounding() const { return step_rounding_; }

 private:
  void begin_interval();
  void step_physics();

  HeldScene held_;
  scene::Scene scene_;
  dynamics::State state_;
  int ticks_per_step_;
  double h_;
  double step_;
  long ticks_{0};
  long failed_{0};
  bool measures_losses_{false};
  double step_loss_{0.0};
  double step_rounding_{0.0};
  haptics::LocalModeler modeler_;
  haptics::LocalModel model_;
  haptics::LocalDynamics local_;
  haptics::PortLoads loads_;
  std::span<const haptics::PortLoad> means_;
  std::vector<haptics::CouplingTarget> targets_;
  std::vector<haptics::PortWrench> felt_;
};

/// The doll of 52 joints as it hangs at rest, one or two hands holding its wrists.
[[nodiscard]] HeldScene held_doll(int hands, const haptics::CouplingGains& gains);

/// A limb on a sprung joint, and a ball for each of one or two hands that a touch pointer moves: no gravity. The first
/// hand's is above the tip, which it can push along -z; the second's below the limb's middle, which it can push along
/// z.
[[nodiscard]] HeldScene touched_limb(const std::vector<haptics::CouplingGains>& hands);

/// Where the held frame of pointer k is at the scene's start.
[[nodiscard]] haptics::CouplingTarget held_pose(const HeldScene& held, int k);

}  // namespace layfigure::testing
