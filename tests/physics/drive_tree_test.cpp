// Drives on whole trees, beside every kind of joint and row: forces, energy, order, mirror images, saved states.
#include <gtest/gtest.h>

#include <cmath>

#include "constrained_scene.h"
#include "layfigure/math/rotation.h"
#include "ledger_check.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// As in contact_test.cpp: the locked axis costs so many digits.
constexpr double kReplayTolerance = 2e-10;

/// Drives of several joints of a tree towards rotations some way off, two of them on one joint.
std::vector<Drive> tree_drives(const Model& model, double max_torque) {
  std::vector<Drive> drives;
  for (const int body : {1, 3, 4, 6, 6, 8}) {
    const double k = static_cast<double>(drives.size());
    Drive& drive = drives.emplace_back();
    drive.body = body;
    drive.stiffness = 5.0 + 3.0 * k;
    drive.damping = 0.1 + 0.05 * k;
    drive.max_torque = max_torque;
    drive.target_rotation =
        model.body(body).rotation * math::exp_rotation(Eigen::Vector3d(0.3 - 0.1 * k, 0.2, 0.15 * k - 0.4));
    drive.target_velocity = {0.5, -0.2 * k, 0.3};
  }
  return drives;
}

/// Torques between the bodies of a joint.
class ReplayedTorques : public Loads {
 public:
  ReplayedTorques(const Model& model, const std::vector<Drive>& drives, const Workspace& workspace)
      : torques_(model.size(), Eigen::Vector3d::Zero()) {
    for (std::size_t k = 0; k < drives.size(); ++k) {
      const Eigen::Vector3d& torque = workspace.drive_torque(static_cast<int>(k));
      torques_[drives[k].body] += torque;
      const int parent = model.body(drives[k].body).parent;
      if (parent >= 0) torques_[parent] -= torque;
    }
  }
  void add(double, std::span<BodyForce> forces) const override {
    for (std::size_t i = 0; i < forces.size(); ++i) forces[i].torque += torques_[i];
  }

 private:
  std::vector<Eigen::Vector3d> torques_;
};

TEST(DrivenTree, TorquesReplayedAsLoads_MakeTheSameStep) {
  for (const RootKind root : {RootKind::kBall, RootKind::kFree, RootKind::kFixed}) {
    for (const double yield : {0.2, kInfinity}) {
      for (const double max_torque : {0.3, kInfinity}) {
        const Model model(bent_tree(root, yield));
        const State before = initial_state(model);
        const std::vector<Drive> drives = tree_drives(model, max_torque);
        const std::vector<Contact> contacts = tree_contacts(model, before);
        Workspace workspace(model);
        State state = before;
        const auto report = step(model, state, workspace, {.drives = drives}, {.step = 2e-3});
        ASSERT_TRUE(report.converged);
        EXPECT_EQ(report.constraints.rows, 0);
        for (int k = 0; k < static_cast<int>(drives.size()); ++k) {
          EXPECT_LE(workspace.drive_torque(k).norm(), max_torque * (1.0 + 1e-12));
        }
        State replayed = before;
        const ReplayedTorques loads(model, drives, workspace);
        ASSERT_TRUE(step(model, replayed, workspace, {.loads = &loads}, {.step = 2e-3}).converged);
        EXPECT_LE(largest_momentum_difference(state, replayed), kReplayTolerance);
      }
    }
  }
}

TEST(DrivenTree, ContactsTiesAndLimits_AreSolvedWithTheDrives) {
  ModelDefinition definition = bent_tree(RootKind::kFree, 0.3);
  for (BodyDefinition& body : definition.bodies) {
    body.limits.reference = body.rotation;
    body.limits.twist_lower = -0.1;
    body.limits.twist_upper = 0.05;
    body.limits.swing_lower = {0.1, 0.2};
    body.limits.swing_upper = {0.05, 0.1};
  }
  const Model model(definition);
  State state = initial_state(model);
  const std::vector<Drive> drives = tree_drives(model, 0.5);
  const std::vector<Tie> ties = tree_ties(model, state);
  Workspace workspace(model);
  int most = 0;
  for (int n = 0; n < 300; ++n) {
    const std::vector<Contact> contacts = tree_contacts(model, state);
    const Inputs inputs{.contacts = contacts, .ties = ties, .drives = drives};
    const Energy before = energy(model, state);
    const StepReport report = step(model, state, workspace, inputs, {.step = 1e-3});
    ASSERT_EQ(report.status, StepStatus::kOk);
    ASSERT_TRUE(report.converged);
    ASSERT_EQ(report.constraints.unsolved, 0);
    ASSERT_LE(created(before, report, energy(model, state)), 0.0);
    most = std::max(most, report.constraints.acting);
  }
  EXPECT_GT(most, 6) << "limits must act beside ties and contacts";
}

TEST(DrivenTree, BaseSteps_CreateNoEnergy) {
  for (const double max_torque : {0.2, 5.0, kInfinity}) {
    for (const double h : {1e-4, 1e-3, 1.0 / 30, 0.1}) {
      for (const double yield : {0.1, kInfinity}) {
        const Model model(bent_tree(RootKind::kFree, yield));
        const std::vector<Drive> drives = tree_drives(model, max_torque);
        State state = initial_state(model);
        Workspace workspace(model);
        for (int n = 0; n < 100; ++n) {
          const Energy before = energy(model, state);
          const StepReport report = step(model, state, workspace, {.drives = drives}, {.step = h});
          ASSERT_EQ(report.status, StepStatus::kOk);
          ASSERT_TRUE(report.converged) << max_torque << " N m, h = " << h << ", step " << n;
          ASSERT_LE(created(before, report, energy(model, state)), 0.0)
              << max_torque << " N m, h = " << h << ", step " << n;
        }
      }
    }
  }
}

State run(const Model& model, const std::vector<Drive>& drives, double duration, int steps, int order) {
  State state = initial_state(model);
  Workspace workspace(model);
  for (int n = 0; n < steps; ++n) {
    std::vector<Drive> now = drives;
    for (Drive& drive : now) {
      drive.target_rotation = math::exp_rotation(duration * n / steps * drive.target_velocity) * drive.target_rotation;
    }
    const StepReport report =
        step(model, state, workspace, {.drives = now}, {.step = duration / steps, .order = order});
    EXPECT_EQ(report.status, StepStatus::kOk);
    EXPECT_EQ(report.extrapolated, order > 1);
  }
  return state;
}

TEST(DrivenTree, OrdersOfTheSteps_AreKept) {
  ModelDefinition definition = bent_tree(RootKind::kFree, kInfinity);
  definition.bodies[4].joint.shape.locked = {false, false, false};
  const Model model(definition);
  // Unbounded, and bounded all the time.
  for (const double max_torque : {kInfinity, 0.05}) {
    std::vector<Drive> drives = tree_drives(model, max_torque);
    if (max_torque < kInfinity) {
      for (Drive& drive : drives) drive.stiffness *= 10.0;
    }
    const State exact = run(model, drives, 0.05, 1600, 4);
    for (int order = 1; order <= 4; ++order) {
      const double coarse = largest_momentum_difference(run(model, drives, 0.05, 200, order), exact);
      const double fine = largest_momentum_difference(run(model, drives, 0.05, 400, order), exact);
      EXPECT_NEAR(std::log2(coarse / fine), order, 0.4)
          << max_torque << " N m, order " << order << ": " << coarse << " -> " << fine;
    }
  }
}

/// Mirror images in the x-z plane, of polar vectors, axial vectors and rotations.
Eigen::Vector3d mirrored(const Eigen::Vector3d& v) { return {v.x(), -v.y(), v.z()}; }
Eigen::Vector3d mirrored_axial(const Eigen::Vector3d& v) { return {-v.x(), v.y(), -v.z()}; }
Eigen::Quaterniond mirrored(const Eigen::Quaterniond& q) { return {q.w(), -q.x(), q.y(), -q.z()}; }

ModelDefinition mirrored(ModelDefinition definition) {
  const Eigen::DiagonalMatrix<double, 3> M(1.0, -1.0, 1.0);
  for (BodyDefinition& body : definition.bodies) {
    body.anchor = mirrored(body.anchor);
    body.com = mirrored(body.com);
    body.rotation = mirrored(body.rotation);
    body.rest_rotation = mirrored(body.rest_rotation);
    body.joint.shape.axes = mirrored(body.joint.shape.axes);
    body.inertia = M * body.inertia * M;
  }
  return definition;
}

TEST(DrivenTree, MirroredWorld_MovesAlike) {
  const ModelDefinition definition = bent_tree(RootKind::kFree, 0.2);
  const Model model(definition);
  const Model image(mirrored(definition));
  const std::vector<Drive> drives = tree_drives(model, 0.4);
  std::vector<Drive> image_drives = drives;
  for (Drive& drive : image_drives) {
    drive.target_rotation = mirrored(drive.target_rotation);
    drive.target_velocity = mirrored_axial(drive.target_velocity);
  }
  const State a = run(model, drives, 0.2, 200, 1);
  const State b = run(image, image_drives, 0.2, 200, 1);
  for (int i = 0; i < model.size(); ++i) {
    EXPECT_LE(math::log_rotation(mirrored(a.bodies[i].rotation) * b.bodies[i].rotation.conjugate()).norm(), 1e-8);
  }
}

TEST(DrivenTree, SavedState_GoesOnBitForBit) {
  const Model model(bent_tree(RootKind::kFree, 0.2));
  const std::vector<Drive> drives = tree_drives(model, 0.4);
  for (const int order : {1, 4}) {
    State state = initial_state(model);
    Workspace workspace(model);
    State saved;
    for (int n = 0; n < 40; ++n) {
      if (n == 20) saved = state;
      (void)step(model, state, workspace, {.drives = drives}, {.step = 2e-3, .order = order});
    }
    Workspace other(model);
    for (int n = 20; n < 40; ++n) {
      (void)step(model, saved, other, {.drives = drives}, {.step = 2e-3, .order = order});
    }
    for (int i = 0; i < model.size(); ++i) {
      EXPECT_EQ(state.bodies[i].rotation.coeffs(), saved.bodies[i].rotation.coeffs());
      EXPECT_EQ(state.bodies[i].angular_momentum, saved.bodies[i].angular_momentum);
    }
  }
}

}  // namespace
}  // namespace layfigure::testing
