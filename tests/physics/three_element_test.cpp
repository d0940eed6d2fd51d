// Closed forms of the three-element model. The body's inertia is made negligible, so that only the joint law acts.
#include <gtest/gtest.h>

#include <cmath>
#include <ostream>

#include "layfigure/dynamics/step.h"
#include "layfigure/math/rotation.h"
#include "scene.h"

namespace layfigure::dynamics {
namespace {

constexpr double kStiffness = 2.0;
constexpr double kDamping = 0.1;
constexpr double kFlowDamping = 5.0;
constexpr double kTorque = 0.3;
const Eigen::Vector3d kAxis = Eigen::Vector3d(1.0, 2.0, -2.0) / 3.0;
// Mass and inertia of 1e-9 leave an inertial transient of D_f and 1e-9 kg m^2: shorter than 1e-7 s.
constexpr double kTiny = 1e-9;

ModelDefinition light_joint(double yield, FlowLaw law) {
  ModelDefinition definition;
  definition.gravity.setZero();
  definition.law = law;
  BodyDefinition body;
  body.mass = kTiny;
  body.inertia = kTiny * Eigen::Matrix3d::Identity();
  body.joint = {.stiffness = kStiffness, .damping = kDamping, .flow_damping = kFlowDamping, .yield_torque = yield};
  definition.bodies.push_back(body);
  return definition;
}

class ConstantTorque : public Loads {
 public:
  explicit ConstantTorque(double until) : until_(until) {}
  void add(double time, std::span<BodyForce> forces) const override {
    // Half a microsecond of slack: the load acts in the sub-step that ends at `until`, whatever rounding does.
    if (time <= until_ + 5e-7) forces[0].torque += kTorque * kAxis;
  }

 private:
  double until_;
};

double angle_along_axis(const Eigen::Quaterniond& q) { return math::log_rotation(q).dot(kAxis); }

class ThreeElement : public ::testing::TestWithParam<FlowLaw> {};

TEST_P(ThreeElement, ConstantTorque_CreepsAsTheClosedForm) {
  const Model model(light_joint(0.0, GetParam()));
  for (const int order : {1, 2, 3, 4}) {
    State state = initial_state(model);
    Workspace workspace(model);
    const ConstantTorque load(10.0);
    const double h = 1e-3;
    double worst = 0.0;
    for (int k = 1; k <= 1000; ++k) {
      ASSERT_EQ(step(model, state, workspace, {.loads = &load}, {.step = h, .order = order}).status, StepStatus::kOk);
      const double t = k * h;
      const double expected =
          kTorque / kStiffness * (1.0 - std::exp(-kStiffness * t / kDamping)) + kTorque * t / kFlowDamping;
      worst = std::max(worst, std::abs(angle_along_axis(state.bodies[0].rotation) - expected));
    }
    // Implicit Euler on a decay of 50 ms with 1 ms steps is off by h/2 of the rate; each order takes h/tau off.
    const double tolerance[] = {1e-3, 2e-5, 5e-7, 0.0};
    // The closed form has no inertia; the body's delays the creep by this much.
    const double inertial = kTorque * kTiny / (kDamping * kDamping);
    EXPECT_LT(worst, tolerance[order - 1] + 1.1 * inertial) << "order " << order;
  }
}

TEST_P(ThreeElement, AfterRelease_TheCreepStays) {
  const Model model(light_joint(0.0, GetParam()));
  State state = initial_state(model);
  Workspace workspace(model);
  const double duration = 0.5;
  const ConstantTorque load(duration);
  for (int k = 0; k < 4000; ++k) {
    state.time = k * 1e-3;
    ASSERT_EQ(step(model, state, workspace, {.loads = &load}, {.step = 1e-3}).status, StepStatus::kOk);
  }
  // t0 T / D_d: the flow of the load. What the spring gave back flowed back as it relaxed, q0 K_f T_r / D_d in all,
  // with the elastic strain at release q0 = t0 / K_f (1 - exp(-K_f T / D_f)) and its relaxation.
  const double crept = kTorque * duration / kFlowDamping;
  EXPECT_NEAR(angle_along_axis(state.bodies[0].rest_rotation), crept, 1e-6);
  EXPECT_NEAR(angle_along_axis(state.bodies[0].rotation), crept, 1e-6);
}

TEST_P(ThreeElement, HeldStrain_RelaxesAsTheClosedForm) {
  const Model model(light_joint(0.0, GetParam()));
  const double strain = 0.4;
  State state = initial_state(model);
  Workspace workspace(model);
  state.bodies[0].rotation = math::exp_rotation(strain * kAxis);
  // Held there by a coupling so stiff that the joint does not move.
  Coupling hold{.body = 0, .angular_stiffness = 1e9, .angular_damping = 1e6};
  hold.target_rotation = state.bodies[0].rotation;
  const double h = 1e-3;
  double worst = 0.0;
  for (int k = 1; k <= 3000; ++k) {
    ASSERT_EQ(step(model, state, workspace, {.couplings = {&hold, 1}}, {.step = h, .order = 2}).status,
              StepStatus::kOk);
    const double held = angle_along_axis(state.bodies[0].rotation) - angle_along_axis(state.bodies[0].rest_rotation);
    // The elastic strain q_f decays; the torque is K_f q_f + D_f w_f, proportional to it.
    worst = std::max(worst, std::abs(held - strain * std::exp(-kStiffness * k * h / (kDamping + kFlowDamping))));
  }
  EXPECT_LT(worst, 1e-6);
}

TEST_P(ThreeElement, BelowYield_NothingStays) {
  const Model model(light_joint(1.01 * kTorque, GetParam()));
  State state = initial_state(model);
  Workspace workspace(model);
  const ConstantTorque load(0.5);
  int yielding = 0;
  for (int k = 0; k < 2000; ++k) {
    const StepReport report = step(model, state, workspace, {.loads = &load}, {.step = 1e-3});
    ASSERT_EQ(report.status, StepStatus::kOk);
    yielding += report.yielding;
  }
  EXPECT_EQ(yielding, 0);
  EXPECT_EQ(state.bodies[0].rest_rotation.coeffs(), Eigen::Quaterniond::Identity().coeffs());
  EXPECT_LT(math::log_rotation(state.bodies[0].rotation).norm(), 1e-9);
}

TEST_P(ThreeElement, AboveYield_FlowsAtTheLawsRate) {
  const double yield = 0.6 * kTorque;
  const Model model(light_joint(yield, GetParam()));
  State state = initial_state(model);
  Workspace workspace(model);
  const ConstantTorque load(1e9);
  const auto run_to = [&](int steps) {
    for (int k = 0; k < steps; ++k) {
      ASSERT_EQ(step(model, state, workspace, {.loads = &load}, {.step = 1e-3}).status, StepStatus::kOk);
    }
  };
  run_to(1000);  // 20 time constants: the spring has settled
  const double before = angle_along_axis(state.bodies[0].rest_rotation);
  run_to(1000);
  const double rate = angle_along_axis(state.bodies[0].rest_rotation) - before;
  const double expected = GetParam() == FlowLaw::kPaper ? kTorque / kFlowDamping : (kTorque - yield) / kFlowDamping;
  EXPECT_NEAR(rate, expected, 1e-7);
}

[[maybe_unused]] void PrintTo(FlowLaw law, std::ostream* out) {
  *out << (law == FlowLaw::kPaper ? "paper" : "overstress");
}

INSTANTIATE_TEST_SUITE_P(BothLaws, ThreeElement, ::testing::Values(FlowLaw::kPaper, FlowLaw::kOverstress),
                         [](const auto& test) { return test.param == FlowLaw::kPaper ? "Paper" : "Overstress"; });

}  // namespace
}  // namespace layfigure::dynamics
