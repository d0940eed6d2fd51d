// Base steps never create energy, whatever would: bodies that turn, ways that curve, loads beyond all measure.
#include <gtest/gtest.h>

#include <cmath>

#include "layfigure/math/rotation.h"
#include "ledger_check.h"
#include "scene.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

class ConstantForce : public Loads {
 public:
  ConstantForce(int body, const Eigen::Vector3d& force) : body_(body), force_(force) {}
  void add(double, std::span<BodyForce> forces) const override { forces[body_].force += force_; }

 private:
  int body_;
  Eigen::Vector3d force_;
};

struct Outcome {
  State state;
  double created{-1.0};  ///< largest of a step
  double taken_back{0.0};
  int retries{0};
};

Outcome run_steps(const Model& model, State state, const Inputs& inputs, double h, int steps) {
  Workspace workspace(model);
  Outcome result{.state = std::move(state)};
  for (int k = 0; k < steps; ++k) {
    const Energy before = energy(model, result.state);
    const StepReport report = step(model, result.state, workspace, inputs, {.step = h});
    EXPECT_EQ(report.status, StepStatus::kOk);
    EXPECT_TRUE(report.converged);
    result.created = std::max(result.created, created(before, report, energy(model, result.state)));
    result.taken_back += report.taken_back;
    result.retries += report.retries;
  }
  return result;
}

/// A box that spins off its principal axes in the air.
Model tumbling_box() {
  ModelDefinition definition;
  definition.root = RootKind::kFree;
  definition.gravity.setZero();
  definition.bodies.resize(1);
  definition.bodies[0].inertia = Eigen::Vector3d(1.0, 2.0, 2.8).asDiagonal();
  return Model(definition);
}

State tumbling(const Model& model, double spin) {
  State state = initial_state(model);
  state.bodies[0].angular_momentum = spin * Eigen::Vector3d(1.0, 1.6, -1.4);
  state.bodies[0].linear_momentum = {0.3, 0.0, 4.0};
  return state;
}

TEST(Passivity, TumblingBox_GainsNothingAndKeepsItsLinearMomentum) {
  const Model model = tumbling_box();
  for (const double h : {1e-5, 1e-3, 0.1}) {
    for (const double spin : {0.1, 10.0, 1000.0}) {
      const State start = tumbling(model, spin);
      const Outcome end = run_steps(model, start, {}, h, 300);
      EXPECT_LE(end.created, 0.0) << h << " s, " << spin << " rad/s";
      if (h * spin > 1e-4) {
        EXPECT_GT(end.taken_back, 0.0) << "turning must have created some";
      }
      const Eigen::Vector3d& linear = start.bodies[0].linear_momentum;
      EXPECT_LT((end.state.bodies[0].linear_momentum - linear).norm(), 1e-13 * linear.norm());
      EXPECT_GT(energy(model, end.state).total(), 0.99 * energy(model, start).total()) << "nor is more than that taken";
    }
  }
}

TEST(Passivity, TumblingBox_StaysOfFirstOrder) {
  const Model model = tumbling_box();
  const auto end = [&](int steps, int order) {
    State state = tumbling(model, 3.0);
    Workspace workspace(model);
    for (int k = 0; k < steps; ++k) {
      EXPECT_EQ(step(model, state, workspace, {}, {.step = 1.0 / steps, .order = order}).status, StepStatus::kOk);
    }
    return state.bodies[0].rotation;
  };
  const Eigen::Quaterniond reference = end(4000, 4);
  const double coarse = end(1000, 1).angularDistance(reference);
  const double fine = end(2000, 1).angularDistance(reference);
  EXPECT_NEAR(coarse / fine, 2.0, 0.1) << coarse << " rad, " << fine << " rad";
}

TEST(Passivity, SwingingPendulum_NeverGains) {
  Scene scene = chain({.links = 3, .bend = 0.0, .stiffness = 0.0, .damping = 0.0});
  const Model model(scene.definition);
  for (const double h : {1e-4, 1e-3, 1e-2, 1.0 / 30}) {
    const Outcome end = run_steps(model, initial_state(model), {}, h, static_cast<int>(2.0 / h));
    EXPECT_LE(end.created, 0.0) << h;
  }
}

/// A rod on a spring that would carry it upright, let go a twentieth of a radian off its vertical.
ModelDefinition rod(double from_down) {
  ModelDefinition definition;
  definition.bodies.resize(1);
  BodyDefinition& body = definition.bodies[0];
  body.com = {0.0, 0.0, -0.1};
  body.inertia = 1e-3 * Eigen::Matrix3d::Identity();
  body.joint.stiffness = 1.5 * body.mass * 9.81 * 0.1;
  body.joint.damping = 0.0;
  body.rest_rotation = math::exp_rotation({from_down, 0.0, 0.0});
  body.rotation = math::exp_rotation({from_down + 0.05, 0.0, 0.0});
  return definition;
}

TEST(Passivity, RodThatStands_LosesWhatOneThatHangsWouldGain) {
  // The curved way of what hangs ends higher than its velocity says, that of what stands lower.
  const Model standing(rod(M_PI));
  const Outcome stood = run_steps(standing, initial_state(standing), {}, 1e-3, 3000);
  EXPECT_LE(stood.created, 0.0);
  EXPECT_EQ(stood.taken_back, 0.0);
  ModelDefinition loose = rod(0.0);
  loose.bodies[0].joint.stiffness = 0.0;
  const Model hanging(loose);
  const Outcome hung = run_steps(hanging, initial_state(hanging), {}, 1e-3, 3000);
  EXPECT_LE(hung.created, 0.0);
  EXPECT_GT(hung.taken_back, 0.0) << "nothing but the curved way can have created it";
}

TEST(Passivity, DollThatSwingsOut_NeverGains) {
  // From fast to slow: what its limbs gain and lose on their ways comes near to what the springs lose.
  const Scene scene = load_scene(LAYFIGURE_TEST_DATA "/scenes/doll-52.json");
  const Model model(scene.definition);
  for (const double h : {1e-3, 1e-2, 1.0 / 30}) {
    const Outcome end = run_steps(model, initial_state(model), {}, h, static_cast<int>(8.0 / h));
    EXPECT_LE(end.created, 0.0) << h;
  }
}

TEST(Passivity, AnisotropicSpring_IsConservative) {
  // Wound up by large angles about all axes at once: only the gradient of the energy gives it back.
  ModelDefinition definition;
  definition.gravity.setZero();
  definition.bodies.resize(1);
  BodyDefinition& body = definition.bodies[0];
  body.inertia = 1e-2 * Eigen::Matrix3d::Identity();
  body.joint.stiffness = 2.0;
  body.joint.shape.axes = math::exp_rotation({0.3, -0.8, 0.5});
  body.joint.shape.stiffness = {0.2, 1.0, 4.0};
  body.rotation = math::exp_rotation({1.2, -0.7, 0.9});
  const Model model(definition);
  State state = initial_state(model);
  Workspace workspace(model);
  const double start = energy(model, state).total();
  for (int k = 0; k < 4000; ++k) {
    ASSERT_EQ(step(model, state, workspace, {}, {.step = 1e-3, .order = 4}).status, StepStatus::kOk);
  }
  EXPECT_NEAR(energy(model, state).total(), start, 1e-6 * start);
  const Outcome base = run_steps(model, initial_state(model), {}, 1e-2, 400);
  EXPECT_LE(base.created, 0.0);
  EXPECT_EQ(base.taken_back, 0.0) << "springs create nothing that must be taken back";
}

TEST(Passivity, LockedAxes_OfABentJointStayLockedAndPassive) {
  ModelDefinition definition;
  definition.bodies.resize(1);
  BodyDefinition& body = definition.bodies[0];
  body.com = {0.1, 0.05, 0.0};
  body.inertia = 1e-2 * Eigen::Matrix3d::Identity();
  body.joint = {.stiffness = 0.5, .damping = 0.01};
  body.joint.shape.locked = {true, false, false};
  body.rotation = math::exp_rotation({0.0, 1.0, -0.8});
  const Model model(definition);
  const Outcome end = run_steps(model, initial_state(model), {}, 5e-3, 1000);
  EXPECT_LE(end.created, 0.0);
  const Eigen::Vector3d strain = math::log_rotation(end.state.bodies[0].rotation);
  EXPECT_NEAR(strain.x(), 0.0, 1e-7);
  EXPECT_GT(strain.norm(), 0.1);
}

TEST(Passivity, JointBesideAnisotropicOnes_MovesAsItWouldAlone) {
  // An isotropic joint that shares its SIMD lanes with an anisotropic one keeps its own law.
  const auto tree = [](bool beside) {
    ModelDefinition definition = chain({.links = 4, .bend = 0.9}).definition;
    if (!beside) return definition;
    const int n = static_cast<int>(definition.bodies.size());
    for (int i = 0; i < 3 * n; ++i) {
      BodyDefinition body = definition.bodies[i % n];
      if (body.parent >= 0) body.parent += (i / n + 1) * n;
      body.joint.shape.stiffness = {0.3, 1.0, 2.0};
      definition.bodies.push_back(body);
    }
    return definition;
  };
  const Model alone(tree(false));
  const Model beside(tree(true));
  const State one = run_steps(alone, initial_state(alone), {}, 1e-3, 200).state;
  const State all = run_steps(beside, initial_state(beside), {}, 1e-3, 200).state;
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT((one.bodies[i].rotation.coeffs() - all.bodies[i].rotation.coeffs()).norm(), 1e-12) << i;
    EXPECT_GT((one.bodies[i].rotation.coeffs() - all.bodies[4 + i].rotation.coeffs()).norm(), 1e-3) << i;
  }
}

TEST(Passivity, PullBeyondAllMeasure_MovesTheChainAndCreatesNothing) {
  Scene scene = chain({.links = 6, .bend = 0.4});
  const Model model(scene.definition);
  const ConstantForce pull(5, {2e5, -6e5, 8e5});
  for (const double h : {1e-4, 1e-2, 0.1}) {
    const Outcome end = run_steps(model, initial_state(model), {.loads = &pull}, h, 100);
    EXPECT_LE(end.created, 0.0) << h;
    std::vector<BodyPose> poses;
    world_poses(model, end.state, poses);
    EXPECT_GT(poses[5].com.dot(Eigen::Vector3d(0.2, -0.6, 0.8)), 0.4) << "stretched out along the pull, h = " << h;
  }
}

TEST(Passivity, TeleportedHand_DrawsTheChainAndCreatesNothing) {
  Scene scene = chain({.links = 6, .bend = 0.4, .damping = 0.05});
  const Model model(scene.definition);
  Coupling hand{.body = 5, .point = {0.1, 0.0, 0.0}, .stiffness = 1e7, .damping = 100.0};
  hand.target_position = {-8.0, 3.0, 6.0};
  for (const double h : {1e-3, 1e-2}) {
    const Outcome end = run_steps(model, initial_state(model), {.couplings = {&hand, 1}}, h, 300);
    EXPECT_LE(end.created, 0.0) << h;
    std::vector<BodyPose> poses;
    world_poses(model, end.state, poses);
    const Eigen::Vector3d tip = poses[5].origin + poses[5].rotation * hand.point;
    EXPECT_NEAR(tip.dot(hand.target_position.normalized()), 0.6, 0.01) << h;
  }
}

TEST(Passivity, PullBeyondAllMeasureOutOfTheLimits_CreatesNothing) {
  // The first joints begin beyond their limits, whose rows push with more than their share of the pull.
  Scene scene = chain({.links = 6, .bend = 0.4, .stiffness = 100.0});
  for (const int i : {0, 2}) {
    JointLimits& limits = scene.definition.bodies[i].limits;
    limits.reference = math::exp_rotation({0.5, -0.7, 0.4});
    limits.twist_lower = -0.02;
    limits.twist_upper = 0.01;
    limits.swing_lower = {0.1, 0.03};
    limits.swing_upper = {0.05, 0.1};
  }
  const Model model(scene.definition);
  for (const double h : {4e-4, 3e-3, 5e-2}) {
    for (const double force : {1e4, 1e6}) {
      const ConstantForce pull(5, force * Eigen::Vector3d(0.2, -0.6, 0.8));
      const Outcome end = run_steps(model, initial_state(model), {.loads = &pull}, h, 100);
      EXPECT_LE(end.created, 0.0) << h << " s, " << force << " N";
    }
  }
}

TEST(Passivity, StepTooLong_IsMadeInShorterPartsAndSaysSo) {
  Scene scene = chain({.links = 6, .bend = 0.4});
  const Model model(scene.definition);
  const ConstantForce pull(5, {0.0, 0.0, 500.0});
  State state = initial_state(model);
  Workspace workspace(model);
  const StepReport report = step(model, state, workspace, {.loads = &pull}, {.step = 0.05});
  EXPECT_EQ(report.status, StepStatus::kOk);
  EXPECT_GT(report.retries, 0);
  EXPECT_LE(report.retries, 7);
  EXPECT_GE(report.solves, report.retries + 2);
  EXPECT_DOUBLE_EQ(state.time, 0.05);
}

}  // namespace
}  // namespace layfigure::testing
