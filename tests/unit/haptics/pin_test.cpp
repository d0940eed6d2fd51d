#include <gtest/gtest.h>

#include <stdexcept>

#include "pinch.h"
#include "pinched_doll.h"

namespace layfigure::haptics {
namespace {

constexpr int kSpine = 1;
constexpr int kArm = 2;
constexpr int kTip = 3;

/// World position of a point of a body.
Eigen::Vector3d point_of(const Hands& hands, int body, const Eigen::Vector3d& point) {
  Grip grip;
  grip.coupling.body = body;
  grip.coupling.point = point;
  return hands.held_pose(grip).position;
}

class PinKinds : public ::testing::TestWithParam<bool> {};

/// The arm's end is pinned, its root by the doll's own pin, and the spine between them is dragged: a closed loop.
TEST_P(PinKinds, ClosedLoopDragged_HoldsAndStaysFinite) {
  Hands hands(testing::thick_doll(), kStep);
  run(hands, 2000);
  const Pin pin = hands.pin({.bone = kTip, .rigid = GetParam()});
  EXPECT_EQ(pin.bone, kTip);
  const Eigen::Vector3d held = hands.grab({.pointer = 0, .bone = kSpine});
  hands.receive(0, at(held));
  for (const Eigen::Vector3d& shift : {Eigen::Vector3d(0, 0.05, 0), Eigen::Vector3d(0, -0.05, 0.08),
                                       Eigen::Vector3d(0.05, 0, -0.08), Eigen::Vector3d(0, 0, 0)}) {
    hands.receive(0, at(held + shift));
    hands.glide(0, 300);
    for (int k = 0; k < 600; ++k) {
      const dynamics::StepReport report = hands.step();
      ASSERT_EQ(report.status, dynamics::StepStatus::kOk);
      ASSERT_EQ(report.constraints.unsolved, 0);
      ASSERT_LT((point_of(hands, kArm, {0.2, 0, 0}) - pin.position).norm(), 5e-4);
    }
  }
  hands.release(0);
  run(hands, 3000);
  EXPECT_LT(dynamics::energy(hands.model(), hands.state()).kinetic, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(StiffAndRigid, PinKinds, ::testing::Bool(),
                         [](const auto& kind) { return kind.param ? "Rigid" : "Stiff"; });

TEST(Pin, WithRotation_HoldsItToo) {
  for (const bool rigid : {false, true}) {
    Hands hands(testing::thick_doll(), kStep);
    hands.pin({.bone = kArm, .holds_rotation = true, .rigid = rigid});
    run(hands, 1500);
    EXPECT_LT(point_of(hands, kArm, {0.2, 0, 0}).z() - 1.0, 1e-3);
    EXPECT_GT(point_of(hands, kArm, {0.2, 0, 0}).z() - 1.0, -1e-3) << rigid;
  }
}

TEST(Pin, ManyOfThem_AndUnpin) {
  Hands hands(testing::thick_doll(), kStep);
  const int first = hands.pin({.bone = kArm}).id;
  const int second = hands.pin({.bone = kSpine, .rigid = true}).id;
  const int third = hands.pin({.bone = kTip, .point = Eigen::Vector3d(0, 0.01, 0)}).id;
  EXPECT_NE(first, second);
  run(hands, 500);
  hands.unpin(second);
  EXPECT_THROW(hands.unpin(second), std::invalid_argument);
  EXPECT_EQ(hands.pins().all().size(), 2U);
  run(hands, 500);
  hands.unpin_all();
  EXPECT_TRUE(hands.pins().all().empty());
  EXPECT_THROW(hands.unpin(third), std::invalid_argument);
  run(hands, 500);
}

TEST(Pin, AfterReset_IsGone) {
  Hands hands(testing::thick_doll(), kStep);
  hands.pin({.bone = kArm});
  hands.reset();
  EXPECT_TRUE(hands.pins().all().empty());
}

TEST(Pin, BoneWithoutBody_Refused) {
  doll::Doll doll = testing::thick_doll();
  doll.carriers[kTip].body = -1;
  Hands hands(std::move(doll), kStep);
  EXPECT_THROW(hands.pin({.bone = kTip}), std::invalid_argument);
  EXPECT_TRUE(hands.pins().all().empty());
}

}  // namespace
}  // namespace layfigure::haptics
