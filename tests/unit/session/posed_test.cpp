#include "layfigure/session/posed.h"

#include <gtest/gtest.h>

#include "layfigure/haptics/hands.h"
#include "small_doll.h"

namespace layfigure::session {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kStep = 1e-3;         // [s]
constexpr double kRounding = 1e-12;    // [rad, m]
constexpr double kEquilibrium = 2e-6;  // [rad], [m]: the root's turn by its weight is known to fourth order
constexpr int kSpine = 1;
constexpr int kArm = 2;

class Posed : public ::testing::Test {
 protected:
  void step(int count) {
    for (int i = 0; i < count; ++i) ASSERT_EQ(hands_.step().status, dynamics::StepStatus::kOk);
  }
  void put(const std::vector<PosedJoint>& joints) { hands_.recall(posed(hands_.doll(), hands_.memory(), joints)); }
  void expect_pose(double tolerance) const {
    EXPECT_LT(hands_.state().bodies[kSpine].rotation.angularDistance(spine_), tolerance);
    EXPECT_LT(hands_.state().bodies[kArm].rotation.angularDistance(arm_), tolerance);
  }

  haptics::Hands hands_{testing::small_doll(), kStep};
  const Quaterniond spine_{Eigen::AngleAxisd(0.3, Vector3d(0.2, 1.0, 0.4).normalized())};
  const Quaterniond arm_{Eigen::AngleAxisd(0.5, Vector3d(0.6, -0.3, 1.0).normalized())};
};

TEST_F(Posed, WithoutGravity_StaysBitForBit_RootWhereItWasMade) {
  step(50);  // it sags, and moves
  hands_.change({}, Vector3d::Zero());
  put({{kSpine, spine_}, {kArm, arm_}});
  const Vector3d root = hands_.state().bodies[0].position;
  EXPECT_LT((root - hands_.doll().definition.bodies[0].anchor).norm(), kRounding);
  step(1000);
  expect_pose(kRounding);
  EXPECT_LT((hands_.state().bodies[0].position - root).norm(), kRounding);
}

TEST_F(Posed, UnderGravity_IsInEquilibrium) {
  put({{kSpine, spine_}, {kArm, arm_}});
  const dynamics::BodyState root = hands_.state().bodies[0];
  EXPECT_GT((root.position - hands_.doll().definition.bodies[0].anchor).norm(), 1e-4) << "it bears the weight";
  step(3000);
  expect_pose(kEquilibrium);
  EXPECT_LT((hands_.state().bodies[0].position - root.position).norm(), kEquilibrium);
  EXPECT_LT(hands_.state().bodies[0].rotation.angularDistance(root.rotation), kEquilibrium);
}

TEST_F(Posed, OneJoint_OthersKeepTheirRotations) {
  step(2000);
  const Quaterniond spine = hands_.state().bodies[kSpine].rotation;
  put({{kArm, arm_}});
  step(1000);
  EXPECT_LT(hands_.state().bodies[kSpine].rotation.angularDistance(spine), kEquilibrium);
  EXPECT_LT(hands_.state().bodies[kArm].rotation.angularDistance(arm_), kEquilibrium);
}

TEST_F(Posed, LockedAxes_DoNotTurn) {
  hands_.change({}, Vector3d::Zero());
  hands_.lock({kArm}, {true, false, false}, true);
  const Quaterniond& axes = hands_.doll().definition.bodies[kArm].joint.shape.axes;
  const auto about = [&](const Vector3d& axis) { return Quaterniond(Eigen::AngleAxisd(0.4, axes * axis)); };
  const Quaterniond before = hands_.state().bodies[kArm].rotation;
  put({{kArm, before * about(Vector3d::UnitX())}});
  EXPECT_LT(hands_.state().bodies[kArm].rotation.angularDistance(before), kRounding);
  put({{kArm, before * about(Vector3d::UnitY())}});
  step(1000);
  EXPECT_LT(hands_.state().bodies[kArm].rotation.angularDistance(before * about(Vector3d::UnitY())), kRounding);
}

TEST_F(Posed, ToolsAndDrives_ArePutAway) {
  hands_.load_pose({.targets = {{kArm, arm_}}});
  put({{kSpine, spine_}});
  EXPECT_FALSE(hands_.pose_drives().active());
}

TEST_F(Posed, Root_IsRefused) {
  const haptics::DollMemory now = hands_.memory();
  const std::vector<PosedJoint> root{{0, spine_}};
  EXPECT_THROW((void)posed(hands_.doll(), now, root), std::invalid_argument);
}

}  // namespace
}  // namespace layfigure::session
