#include "joint_limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "layfigure/doll/build.h"
#include "layfigure/dynamics/model.h"
#include "person_fixture.h"
#include "range_of_motion.h"
#include "rig_fixture.h"

namespace layfigure::doll {
namespace {

using Eigen::Vector3d;
using test::allows;

const Vector3d kX = Vector3d::UnitX();  // to the person's left
const Vector3d kY = Vector3d::UnitY();  // backwards
const Vector3d kZ = Vector3d::UnitZ();

TEST(JointLimits, Elbow_BendsForwardAndHardlyOtherwise) {
  const Doll doll = build_doll(test::make_person());
  for (const double side : {1.0, -1.0}) {
    const std::string forearm = side > 0 ? "LeftForeArm" : "RightForeArm";
    EXPECT_TRUE(allows(doll, forearm, -side * kZ, 140)) << forearm;
    EXPECT_FALSE(allows(doll, forearm, -side * kZ, 155)) << forearm;
    EXPECT_TRUE(allows(doll, forearm, side * kZ, 4)) << forearm;
    EXPECT_FALSE(allows(doll, forearm, side * kZ, 8)) << forearm;
    for (const double sign : {1.0, -1.0}) {
      EXPECT_FALSE(allows(doll, forearm, sign * kY, 8)) << forearm;
      EXPECT_FALSE(allows(doll, forearm, sign * kX, 8)) << forearm;
    }
  }
}

TEST(JointLimits, Knee_BendsBackwardAndHardlyOtherwise) {
  const Doll doll = build_doll(test::make_person());
  for (const char* shin : {"LeftLeg", "RightLeg"}) {
    EXPECT_TRUE(allows(doll, shin, kX, 125)) << shin;
    EXPECT_FALSE(allows(doll, shin, kX, 140)) << shin;
    EXPECT_FALSE(allows(doll, shin, -kX, 16)) << shin;
    EXPECT_FALSE(allows(doll, shin, kY, 8)) << shin;
    EXPECT_FALSE(allows(doll, shin, -kY, 8)) << shin;
  }
}

TEST(JointLimits, Shoulder_ReachesAllRoundInFrontAndBesideTheBody) {
  const Doll doll = build_doll(test::make_person());
  for (const double side : {1.0, -1.0}) {
    const std::string arm = side > 0 ? "LeftArm" : "RightArm";
    EXPECT_TRUE(allows(doll, arm, side * kY, 85)) << "hanging";
    EXPECT_TRUE(allows(doll, arm, -side * kY, 85)) << "up";
    EXPECT_TRUE(allows(doll, arm, -side * kZ, 125)) << "across the chest";
    EXPECT_TRUE(allows(doll, arm, side * kZ, 40)) << "back";
    EXPECT_FALSE(allows(doll, arm, side * kZ, 60)) << "back";
    EXPECT_FALSE(allows(doll, arm, -side * kZ, 165)) << "through the chest";
    // Palm up and palm down with a stretched arm.
    EXPECT_TRUE(allows(doll, arm, kX, 60));
    EXPECT_TRUE(allows(doll, arm, -kX, 60));
    EXPECT_FALSE(allows(doll, arm, kX, 120));
    EXPECT_FALSE(allows(doll, arm, -kX, 120));
  }
}

TEST(JointLimits, Shoulder_TurnsFurtherOutwardThanInward) {
  const Doll doll = build_doll(test::make_person());
  for (const char* arm : {"LeftArm", "RightArm"}) {
    // Outward lifts the forearm of an elbow that bends forward, on either side.
    EXPECT_TRUE(allows(doll, arm, -kX, 75));
    EXPECT_FALSE(allows(doll, arm, kX, 75));
  }
}

TEST(JointLimits, Hip_SwingsForwardFurtherThanBackAndOutwardFurtherThanInward) {
  const Doll doll = build_doll(test::make_person());
  for (const double side : {1.0, -1.0}) {
    const std::string thigh = side > 0 ? "LeftUpLeg" : "RightUpLeg";
    EXPECT_TRUE(allows(doll, thigh, -kX, 110));
    EXPECT_FALSE(allows(doll, thigh, -kX, 130));
    EXPECT_TRUE(allows(doll, thigh, kX, 25));
    EXPECT_FALSE(allows(doll, thigh, kX, 40));
    EXPECT_TRUE(allows(doll, thigh, -side * kY, 40));
    EXPECT_FALSE(allows(doll, thigh, -side * kY, 55));
    EXPECT_TRUE(allows(doll, thigh, side * kY, 28));
    EXPECT_FALSE(allows(doll, thigh, side * kY, 40));
  }
}

TEST(JointLimits, AnkleAndToes_TurnUpAndDown) {
  const Doll doll = build_doll(test::make_person());
  EXPECT_TRUE(allows(doll, "LeftFoot", -kX, 15));
  EXPECT_FALSE(allows(doll, "LeftFoot", -kX, 25));
  EXPECT_TRUE(allows(doll, "LeftFoot", kX, 45));
  EXPECT_FALSE(allows(doll, "LeftFoot", kX, 55));
  EXPECT_TRUE(allows(doll, "RightToeBase", -kX, 60));
  EXPECT_TRUE(allows(doll, "RightToeBase", kX, 40));
  EXPECT_FALSE(allows(doll, "RightToeBase", kX, 50));
}

TEST(JointLimits, HandAndFingers_CurlTowardsThePalm) {
  const Doll doll = build_doll(test::make_person());  // palms down
  for (const double side : {1.0, -1.0}) {
    const std::string hand = side > 0 ? "LeftHand" : "RightHand";
    const Vector3d curl = side * kY;
    EXPECT_TRUE(allows(doll, hand, curl, 75));
    EXPECT_FALSE(allows(doll, hand, curl, 85));
    EXPECT_FALSE(allows(doll, hand, -curl, 75));
    EXPECT_TRUE(allows(doll, hand, kX, 75));  // pronation and supination
    EXPECT_TRUE(allows(doll, hand, -kX, 75));
    for (const char* finger : {"Index", "Middle", "Ring", "Pinky"}) {
      EXPECT_TRUE(allows(doll, hand + finger + "1", curl, 85)) << finger;
      EXPECT_TRUE(allows(doll, hand + finger + "2", curl, 95)) << finger;
      EXPECT_FALSE(allows(doll, hand + finger + "2", -curl, 8)) << finger;
      EXPECT_FALSE(allows(doll, hand + finger + "2", kZ, 8)) << finger;
      EXPECT_TRUE(allows(doll, hand + finger + "3", curl, 85)) << finger;
    }
    // The thumb, forward and out, bends back across the palm.
    EXPECT_TRUE(allows(doll, hand + "Thumb3", side * kZ, 70));
    EXPECT_FALSE(allows(doll, hand + "Thumb3", -side * kZ, 30));
  }
}

TEST(JointLimits, HandWithoutFingers_HasItsThumbWhereTheElbowBends) {
  const Doll doll = build_doll(test::make_person({.fingers = false}));
  EXPECT_TRUE(allows(doll, "LeftHand", kY, 75));
  EXPECT_FALSE(allows(doll, "LeftHand", -kY, 75));
  EXPECT_TRUE(allows(doll, "RightHand", -kY, 75));
  EXPECT_FALSE(allows(doll, "RightHand", kY, 75));
}

TEST(JointLimits, SpineAndNeck_ShareTheirRanges) {
  const Doll doll = build_doll(test::make_person());
  // Two joints each: spine and chest, neck and head.
  EXPECT_TRUE(allows(doll, "Spine", kX, 38));
  EXPECT_FALSE(allows(doll, "Spine", kX, 42));
  EXPECT_FALSE(allows(doll, "Spine", -kX, 15));
  EXPECT_TRUE(allows(doll, "Head", kZ, 28));
  EXPECT_FALSE(allows(doll, "Head", kZ, 32));
  EXPECT_FALSE(allows(doll, "Neck", -kZ, 32));
}

TEST(JointLimits, HeadWithItsWeightInFront_StillTurnsAboutTheVertical) {
  character::Rig rig = test::make_person();
  for (auto& mesh : rig.meshes) {
    for (auto& vertex : mesh.vertices) vertex.y() -= mesh.name == "Head" ? 0.1 : 0.0;
  }
  const Doll doll = build_doll(rig);
  EXPECT_TRUE(allows(doll, "Head", kZ, 28));
  EXPECT_TRUE(allows(doll, "Head", kX, 20));
}

TEST(JointLimits, ArmsBoundAslant_ElbowStillBendsForward) {
  const double slope = 40.0 * std::numbers::pi / 180.0;
  const Doll doll = build_doll(test::make_person({.arm_slope = slope}));
  for (const double side : {1.0, -1.0}) {
    const std::string forearm = side > 0 ? "LeftForeArm" : "RightForeArm";
    const Vector3d along(side * std::cos(slope), 0, -std::sin(slope));
    const Vector3d axis = along.cross(-kY);
    EXPECT_TRUE(allows(doll, forearm, axis, 140));
    EXPECT_FALSE(allows(doll, forearm, -axis, 8));
  }
}

TEST(JointLimits, ElbowBoundBent_BendsFurtherTheSameWay) {
  character::Rig rig;
  const int hips = test::add_limb(rig, "Hips", -1, {0, 0, 1.0}, {0, 0, 1.4}, 0.15);
  for (const double side : {1.0, -1.0}) {
    const std::string name = side > 0 ? "Left" : "Right";
    const Vector3d elbow(side * 0.5, 0, 1.4);
    const int arm = test::add_limb(rig, name + "Arm", hips, {side * 0.2, 0, 1.4}, elbow, 0.05);
    test::add_limb(rig, name + "ForeArm", arm, elbow, elbow + Vector3d(side * 0.2, 0, 0.2), 0.04);  // 45 degrees up
    const int leg = test::add_limb(rig, name + "UpLeg", hips, {side * 0.1, 0, 1}, {side * 0.1, 0, 0.5}, 0.07);
    const int shin = test::add_limb(rig, name + "Leg", leg, {side * 0.1, 0, 0.5}, {side * 0.1, 0, 0.1}, 0.05);
    test::add_limb(rig, name + "Foot", shin, {side * 0.1, 0, 0.1}, {side * 0.1, -0.15, 0.0}, 0.04);
  }
  const Doll doll = build_doll(rig);
  EXPECT_TRUE(allows(doll, "LeftForeArm", -kY, 100));  // 145 from straight
  EXPECT_FALSE(allows(doll, "LeftForeArm", -kY, 110));
  EXPECT_TRUE(allows(doll, "LeftForeArm", kY, 48));
  EXPECT_FALSE(allows(doll, "LeftForeArm", kY, 55));
  EXPECT_FALSE(allows(doll, "LeftForeArm", -kZ, 30));
}

/// Any turn of any joint, from a fixed seed: the gaps of two dolls, the second one's turn being `map` of the first's.
template <typename Map>
void expect_same_limits(const Doll& a, const Doll& b, const Map& map) {
  ASSERT_EQ(a.definition.bodies.size(), b.definition.bodies.size());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> component(-1.5, 1.5);
  for (int body = 0; body < static_cast<int>(a.definition.bodies.size()); ++body) {
    if (a.definition.bodies[body].parent < 0) continue;
    for (int trial = 0; trial < 20; ++trial) {
      const Vector3d turn(component(random), component(random), component(random));
      EXPECT_NEAR(test::gap(a, body, turn), test::gap(b, body, map(turn)), 1e-6) << a.definition.bodies[body].name;
    }
  }
}

TEST(JointLimits, RigTurnedAboutTheVertical_SameLimits) {
  const Eigen::Isometry3d motion = Eigen::Translation3d(3, -2, 0.5) * Eigen::AngleAxisd(2.2, kZ);
  expect_same_limits(build_doll(test::make_person()), build_doll(test::moved(test::make_person(), motion)),
                     [&](const Vector3d& turn) { return Vector3d(motion.linear() * turn); });
}

TEST(JointLimits, RigScaled_SameLimits) {
  expect_same_limits(build_doll(test::make_person()), build_doll(test::make_person({.scale = 0.01})),
                     [](const Vector3d& turn) { return turn; });
}

TEST(JointLimits, RigReflected_ReflectedLimits) {
  const character::Rig rig = test::make_person({.roll = 0.3});
  expect_same_limits(build_doll(rig), build_doll(test::reflected(rig)),
                     [](const Vector3d& turn) { return Vector3d(turn.x(), -turn.y(), -turn.z()); });
}

TEST(JointLimits, OtherBoneAxes_SameLimits) {
  expect_same_limits(build_doll(test::make_person()), build_doll(test::make_person({.roll = 0.7})),
                     [](const Vector3d& turn) { return turn; });
}

TEST(JointLimits, LeftAndRight_AreEachOthersImages) {
  const Doll doll = build_doll(test::make_person({.arm_slope = 0.4, .roll = 0.7}));
  std::mt19937 random(8);
  std::uniform_real_distribution<double> component(-1.5, 1.5);
  for (int body = 1; body < static_cast<int>(doll.definition.bodies.size()); ++body) {
    const int image = doll.mirror_of_body[body];
    ASSERT_GE(image, 0) << doll.definition.bodies[body].name;
    for (int trial = 0; trial < 20; ++trial) {
      const Vector3d turn(component(random), component(random), component(random));
      EXPECT_NEAR(test::gap(doll, body, turn), test::gap(doll, image, {turn.x(), -turn.y(), -turn.z()}), 1e-9)
          << doll.definition.bodies[body].name;
    }
  }
}

/// One hand of the sculpture is off by a centimetre.
TEST(JointLimits, NearlyMirroredPair_HasExactlyMirroredLimits) {
  character::Rig rig = test::make_person({.fingers = false});
  for (character::Bone& bone : rig.bones) {
    if (bone.name == "RightHand") {
      bone.bind.translation() += Vector3d(0, 0.01, 0.01);
      bone.rest = rig.bones[bone.parent].bind.inverse() * bone.bind;
    }
  }
  const Doll doll = build_doll(rig);
  const int left = test::body_called(doll, "LeftForeArm");
  ASSERT_EQ(doll.mirror_of_body[left], test::body_called(doll, "RightForeArm"));
  for (const Vector3d& turn : {Vector3d(0.1, 0.2, -1.0), Vector3d(-0.3, 0.0, 0.5), Vector3d(0.0, 1.0, 0.0)}) {
    EXPECT_NEAR(test::gap(doll, left, turn),
                test::gap(doll, doll.mirror_of_body[left], {turn.x(), -turn.y(), -turn.z()}),
                1e-2);  // the plane itself is off by a little
  }
  const auto& a = doll.definition.bodies[left].limits;
  const auto& b = doll.definition.bodies[doll.mirror_of_body[left]].limits;
  EXPECT_EQ(a.twist_lower, -b.twist_upper);
  EXPECT_EQ(a.swing_upper[0], b.swing_upper[0]);
  EXPECT_EQ(a.swing_lower[1], b.swing_upper[1]);
}

std::vector<std::string> warnings_of_rest(const Doll& doll) {
  std::vector<std::string> result;
  for (const std::string& warning : doll.warnings) {
    if (warning.find("its rest pose") != std::string::npos) result.push_back(warning);
  }
  return result;
}

TEST(JointLimits, RestPose_IsInsideByAMargin) {
  for (const test::Person& person : {test::Person{}, test::Person{.arm_slope = 1.2}, test::Person{.roll = 1.0}}) {
    const Doll doll = build_doll(test::make_person(person));
    for (int b = 1; b < static_cast<int>(doll.definition.bodies.size()); ++b) {
      EXPECT_GT(test::gap(doll, b, Vector3d::Zero()), 0.99 * kLeastRangeDeg * std::numbers::pi / 180.0)
          << doll.definition.bodies[b].name;
    }
    EXPECT_TRUE(warnings_of_rest(doll).empty());
    EXPECT_NO_THROW(dynamics::Model{doll.definition});
  }
}

TEST(JointLimits, RestPoseBeyondTheLimits_WidensBothOfThePairAndIsReported) {
  character::Rig rig = test::make_person();
  for (character::Bone& bone : rig.bones) {
    // The left knee bent forward by 30 degrees.
    if (bone.name == "LeftLeg") {
      const Eigen::Quaterniond R_WB(bone.bind.linear());
      bone.rest.rotate(R_WB.conjugate() * Eigen::AngleAxisd(-std::numbers::pi / 6, kX) * R_WB);
    }
  }
  const Doll doll = build_doll(rig);
  for (const char* shin : {"LeftLeg", "RightLeg"}) {
    EXPECT_TRUE(allows(doll, shin, -kX, 33)) << shin;
    EXPECT_FALSE(allows(doll, shin, -kX, 40)) << shin;
  }
  ASSERT_EQ(warnings_of_rest(doll).size(), 1U);
  EXPECT_EQ(
      warnings_of_rest(doll)[0],
      "bone 'LeftLeg': its rest pose is beyond what the joint of a shin can do; its limits are widened to include "
      "it");
}

TEST(JointLimits, UnknownBones_TurnWidely) {
  const Doll doll = build_doll(test::make_prism({.bones = 2}));
  EXPECT_TRUE(allows(doll, "bone1", kX, kWideSwingDeg - 1));
  EXPECT_FALSE(allows(doll, "bone1", kX, kWideSwingDeg + 1));
  EXPECT_TRUE(allows(doll, "bone1", kZ, kWideTwistDeg - 1));
  EXPECT_FALSE(allows(doll, "bone1", kZ, kWideTwistDeg + 1));
}

TEST(JointLimits, StatedByTheFileOnOneSide_HoldThereAlone) {
  const Doll plain = build_doll(test::make_person());
  for (const char* side : {"Left", "Right"}) {
    const std::string stated = std::string(side) + "ForeArm";
    const std::string other = std::string(stated[0] == 'L' ? "Right" : "Left") + "ForeArm";
    character::Rig rig = test::make_person();
    character::Bone& bone = rig.bones[plain.bone_of_body[test::body_called(plain, stated)]];
    character::BoneLimits& limits = bone.limits.emplace();
    limits.reference = bone.rest.linear();
    limits.lower = Vector3d::Constant(-0.2);
    limits.upper = Vector3d::Constant(0.3);
    const Doll doll = build_doll(rig);
    const int body = test::body_called(doll, stated);
    EXPECT_EQ(doll.definition.bodies[body].limits.twist_upper, 0.3);
    EXPECT_EQ(doll.definition.bodies[body].limits.swing_lower[0], 0.2);
    EXPECT_EQ(doll.reasons[body].twist.origin, Origin::kFile);
    const int image = test::body_called(doll, other);
    EXPECT_EQ(doll.mirror_of_body[body], image);
    EXPECT_EQ(doll.definition.bodies[image].limits.swing_upper, plain.definition.bodies[image].limits.swing_upper);
    EXPECT_EQ(doll.reasons[image].twist.origin, Origin::kDefault);
  }
}

TEST(JointLimits, KnownBonesOfNoMirroredCharacter_TurnWidely) {
  character::Rig rig;
  const int arm = test::add_limb(rig, "LeftArm", -1, {0, 0, 1}, {0.3, 0, 1}, 0.05);
  test::add_limb(rig, "LeftForeArm", arm, {0.3, 0, 1}, {0.6, 0, 1}, 0.05);
  const Doll doll = build_doll(rig);
  EXPECT_TRUE(allows(doll, "LeftForeArm", kZ, 110));
  EXPECT_TRUE(allows(doll, "LeftForeArm", -kZ, 110));
}

TEST(JointLimits, Roots_HaveNone) { EXPECT_FALSE(build_doll(test::make_person()).definition.bodies[0].limits.any()); }

TEST(RangeOfMotion, EveryRange_IsAtLeastTheLeast) {
  for (int part = 0; part <= static_cast<int>(BonePart::kToes); ++part) {
    for (const int segment : {0, 1, 2, 3}) {
      const RangeOfMotion range = range_of_motion(static_cast<BonePart>(part), segment, 20);
      for (const double degrees : {range.towards_f, range.away_from_f, range.towards_a, range.away_from_a,
                                   range.twist_towards_a, range.twist_away_from_a}) {
        EXPECT_GE(degrees, kLeastRangeDeg);
        EXPECT_LT(degrees, 180.0);
      }
    }
  }
}

TEST(RangeOfMotion, SharedRange_IsDividedByTheJoints) {
  EXPECT_EQ(range_of_motion(BonePart::kChest, 0, 4).towards_f, range_of_motion(BonePart::kSpine, 0, 1).towards_f / 4);
  EXPECT_EQ(range_of_motion(BonePart::kShin, 0, 4).towards_f, range_of_motion(BonePart::kShin, 0, 1).towards_f);
}

}  // namespace
}  // namespace layfigure::doll
