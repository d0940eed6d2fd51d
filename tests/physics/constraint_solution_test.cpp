// How the rows of every kind are solved: to what residual, how soon from the last step's answer, redundant or not.
#include <gtest/gtest.h>

#include <cmath>

#include "constrained_scene.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

constexpr double kG = 9.81;
constexpr int kColdIterations = 20;  // without an answer to begin with
const Eigen::Vector3d kHalf(0.1, 0.2, 0.05);

/// Contacts with the floor, moved along with the block.
std::vector<Contact> floor_contacts(const State& state, double friction) {
  std::vector<Contact> contacts = corner_contacts(kHalf, friction);
  for (Contact& contact : contacts) contact.point_b.head<2>() += state.bodies[0].position.head<2>();
  return contacts;
}

TEST(ConstraintSolution, RestingBlock_IsWarmStarted) {
  for (const int order : {1, 4}) {
    const Model model(block(2.0, kHalf, {0.0, 0.0, -kG}));
    State state = initial_state(model);
    Workspace workspace(model);
    for (int n = 0; n < 200; ++n) {
      const std::vector<Contact> contacts = floor_contacts(state, 0.5);
      const StepReport report = step(model, state, workspace, {.contacts = contacts}, {.step = 1e-3, .order = order});
      ASSERT_EQ(report.constraints.unsolved, 0);
      ASSERT_LE(report.constraints.residual, kLcpTolerance);
      EXPECT_EQ(report.constraints.rows, 12);
      EXPECT_LE(report.constraints.iterations, n > 1 ? 2 : kColdIterations) << "step " << n;
    }
  }
}

TEST(ConstraintSolution, SlidingBlock_IsWarmStarted) {
  const Model model(block(2.0, kHalf, {0.0, 0.0, -kG}));
  State state = initial_state(model);
  state.bodies[0].linear_momentum = {4.0, 3.0, 0.0};
  Workspace workspace(model);
  for (int n = 0; n < 200; ++n) {
    const std::vector<Contact> contacts = floor_contacts(state, 0.3);
    const StepReport report = step(model, state, workspace, {.contacts = contacts}, {.step = 1e-3});
    ASSERT_EQ(report.constraints.unsolved, 0);
    ASSERT_LE(report.constraints.residual, kLcpTolerance);
    EXPECT_LE(report.constraints.iterations, n > 1 ? 2 : kColdIterations) << "step " << n;
  }
  EXPECT_GT(state.bodies[0].linear_momentum.norm(), 1.0) << "it must slide all the time";
}

TEST(ConstraintSolution, RepeatedRows_CarryTheSameLoad) {
  const Model model(block(2.0, kHalf, {0.0, 0.0, -kG}));
  State state = initial_state(model);
  Workspace workspace(model);
  std::vector<Contact> contacts = corner_contacts(kHalf, 0.5);
  const std::vector<Contact> once = contacts;
  for (Contact contact : once) {
    contact.key += 10;
    contacts.push_back(contact);
  }
  Eigen::Vector3d sum;
  for (int n = 0; n < 50; ++n) {
    const StepReport report = step(model, state, workspace, {.contacts = contacts}, {.step = 1e-3});
    ASSERT_EQ(report.constraints.unsolved, 0);
    sum.setZero();
    for (int k = 0; k < 8; ++k) sum += workspace.contact_force(k);
  }
  EXPECT_LE((sum - Eigen::Vector3d(0.0, 0.0, 2.0 * kG)).norm(), 1e-8);
}

/// A doll with both hands pinned, one of them twice, a hand on its hip, and a limb that a drive presses into a contact.
TEST(ConstraintSolution, PinsLoopsContactsAndDrives_AreWarmStartedWhereTheyRest) {
  const Model model(bent_tree(RootKind::kFree, std::numeric_limits<double>::infinity()));
  State state = initial_state(model);
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  std::vector<Tie> ties(4);
  ties[0] = {.body_a = 6, .point_a = model.body(6).com, .point_b = poses[6].com};
  ties[1] = {.body_a = 7, .point_a = model.body(7).com, .point_b = poses[7].com};
  ties[2] = {.body_a = 5, .body_b = 8, .point_a = model.body(5).com};
  ties[2].point_b = poses[8].rotation.conjugate() * (poses[5].com - poses[8].origin);
  ties[3] = ties[0];
  Contact table{.body_a = 2, .point_a = model.body(2).com, .point_b = poses[2].com, .key = 1};
  Drive drive{.body = 2, .stiffness = 20.0, .damping = 1.0, .max_torque = 0.2};
  drive.target_rotation = model.body(2).rotation;
  Workspace workspace(model);
  int iterations = 0;
  for (int n = 0; n < 3000; ++n) {
    const StepReport report =
        step(model, state, workspace, {.contacts = {&table, 1}, .ties = ties, .drives = {&drive, 1}}, {.step = 2e-3});
    ASSERT_EQ(report.status, StepStatus::kOk);
    ASSERT_EQ(report.constraints.unsolved, 0) << "step " << n;
    ASSERT_LE(report.constraints.residual, kLcpTolerance);
    if (n >= 2900) iterations = std::max(iterations, report.constraints.iterations);
  }
  EXPECT_LE(iterations, 2);
  const double force = workspace.tie_force(0).force.norm();
  EXPECT_TRUE(std::isfinite(force));
  EXPECT_GT(force + workspace.tie_force(3).force.norm(), 0.1) << "one of the two pins must hold the hand";
}

TEST(ConstraintSolution, TieThatContradictsAContact_IsBoundedAndReported) {
  const Model model(block(2.0, kHalf, {0.0, 0.0, -kG}));
  State state = initial_state(model);
  Workspace workspace(model);
  const Tie pull{.body_a = 0, .point_b = {0.0, 0.0, -0.5}};
  int unsolved = 0;
  for (int n = 0; n < 200; ++n) {
    const std::vector<Contact> contacts = floor_contacts(state, 0.5);
    const StepReport report = step(model, state, workspace, {.contacts = contacts, .ties = {&pull, 1}}, {.step = 1e-3});
    ASSERT_EQ(report.status, StepStatus::kOk);
    unsolved += report.constraints.unsolved;
    ASSERT_LE(state.bodies[0].linear_momentum.norm(), 2.0 * kLargestClosingSpeed);
  }
  EXPECT_GT(unsolved, 100);
}

TEST(ConstraintSolution, GraspOfLimitedForce_SlipsUnderAHeavierLoad) {
  // A hand of the tree grasps a free block with rotation; the block is too heavy, then not.
  for (const double most : {5.0, 30.0}) {
    const Model model(block(2.0, kHalf, {0.0, 0.0, -kG}));
    State state = initial_state(model);
    Workspace workspace(model);
    Tie grasp{.body_a = 0, .point_a = model.body(0).com, .point_b = model.body(0).com, .max_force = most};
    grasp.holds_rotation = true;
    grasp.max_torque = 1.0;
    for (int n = 0; n < 200; ++n) {
      ASSERT_EQ(step(model, state, workspace, {.ties = {&grasp, 1}}, {.step = 1e-3}).constraints.unsolved, 0);
    }
    const double fallen = -state.bodies[0].position.z();
    const double expected = 0.5 * std::max(kG - most / 2.0, 0.0) * 0.2 * 0.2;
    EXPECT_NEAR(fallen, expected, 1e-2 * expected + 1e-9) << most << " N";
  }
}

}  // namespace
}  // namespace layfigure::testing
