#include "stress_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "cpu_clock.h"
#include "ledger_check.h"
#include "stress_checks.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

// A scene whose rows contradict each other in every problem has shown what there is to see after so many of them.
constexpr int kEnoughUnsolved = 30;

State start_of(const Model& model, const StressScene& scene) {
  State state = initial_state(model);
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  for (int i = 0; i < model.size(); ++i) {
    const Eigen::Matrix3d R = poses[i].rotation.toRotationMatrix();
    state.bodies[i].angular_momentum = R * model.body(i).inertia * R.transpose() * scene.spins[i];
  }
  return state;
}

std::string text_of(const char* what, double value) {
  std::ostringstream text;
  text << what << " " << value << " J";
  return text.str();
}

/// A scene on its way, checked after every step.
class Run {
 public:
  explicit Run(const StressScene& scene)
      : scene_(scene),
        stepper_(scene.definition),
        state_(start_of(stepper_.model(), scene)),
        couplings_(scene.couplings),
        loads_(scene.forces),
        overlaps_(scene.definition),
        energy_(energy(stepper_.model(), state_)) {}

  /// What is wrong after one more step.
  std::string advance(int index, StressOutcome& outcome) {
    change_inputs(index);
    const State before = state_;
    const Inputs inputs{.loads = &loads_, .couplings = couplings_, .ties = scene_.ties, .drives = scene_.drives};
    const double start = thread_cpu_seconds();
    const StepReport report =
        stepper_.step(state_, inputs, {.step = scene_.h, .order = scene_.order, .sleep_angle = scene_.sleep_angle})
            .step;
    outcome.cpu_seconds += thread_cpu_seconds() - start;
    ++outcome.steps;
    if (report.status == StepStatus::kNotFinite) return "not finite";
    if (report.status != StepStatus::kOk) return "creates energy";
    outcome.retried += report.retries > 0 ? 1 : 0;
    outcome.taken_back += report.taken_back > 0.0 ? 1 : 0;
    outcome.unconverged += report.converged ? 0 : 1;
    outcome.unsolved += report.constraints.unsolved;
    return check(before, report);
  }

 private:
  void change_inputs(int index) {
    if (index == scene_.steps / 2) {
      for (Coupling& coupling : couplings_) coupling.target_position += scene_.teleport;
    }
    if (index == scene_.steps / 3) {
      for (BodyState& body : state_.bodies) body.yield_scale = scene_.softness;
    }
  }

  std::string check(const State& before, const StepReport& report) {
    const Model& model = stepper_.model();
    const Energy last = energy_;
    energy_ = energy(model, state_);
    if (!std::isfinite(energy_.total())) return "energy is not finite";
    if (std::string broken = broken_geometry(model, state_); !broken.empty()) return broken;
    if (std::string broken = broken_answer(stepper_, scene_); !broken.empty()) return broken;
    if (scene_.order > 1) return "";
    const double excess = created(last, report, energy_);
    if (!(excess <= 0.0)) return text_of("created", excess);
    return overlaps_.grown(stepper_, before, state_, scene_.h, report.constraints.unsolved > 0);
  }

  const StressScene& scene_;
  scene::Scene stepper_;
  State state_;
  std::vector<Coupling> couplings_;
  ConstantForces loads_;
  OverlapBound overlaps_;
  Energy energy_;
};

}  // namespace

StressOutcome run(const StressScene& scene) {
  StressOutcome outcome;
  Run run(scene);
  for (int k = 0; k < scene.steps && outcome.unsolved < kEnoughUnsolved; ++k) {
    outcome.failure = run.advance(k, outcome);
    if (outcome.failure.empty()) continue;
    outcome.failure += " in step " + std::to_string(k);
    return outcome;
  }
  return outcome;
}

}  // namespace layfigure::testing
