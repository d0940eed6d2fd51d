#include "layfigure/skinning/deform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fixture.h"
#include "tube_rig.h"

namespace layfigure::skinning {
namespace {

using character::Rig;
using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;
using test::Deformed;
using test::deformed;

constexpr double kRounding = 1e-14;
constexpr double kPi = std::numbers::pi;

/// One vertex on two bones that are bound in the world's own axes, `weight` on the first.
Rig two_bones(const Vector3d& vertex, double weight) {
  Rig rig;
  rig.bones.resize(2);
  character::SkinnedMesh& mesh = rig.meshes.emplace_back();
  mesh.vertices.push_back(vertex);
  mesh.influences.push_back({{0, weight}, {1, 1.0 - weight}});
  return rig;
}

Isometry3d turn(double angle, const Vector3d& axis) { return Isometry3d(AngleAxisd(angle, axis)); }

class DeformBy : public ::testing::TestWithParam<Blend> {};
INSTANTIATE_TEST_SUITE_P(Blends, DeformBy, ::testing::Values(Blend::kLinear, Blend::kDualQuaternion),
                         [](const auto& tested) {
                           return tested.param == Blend::kLinear ? "Linear" : "DualQuaternion";
                         });

TEST_P(DeformBy, BindPose_IsTheBoundMesh) {
  const Skin skin(testing::tube_rig({}));
  const Deformed result = deformed(skin, test::bind_poses(skin), GetParam());
  for (int v = 0; v < skin.vertex_count(); ++v) {
    EXPECT_LT((result.positions[v] - skin.bind_positions()[v]).norm(), kRounding);
    EXPECT_LT((result.normals[v] - skin.bind_normals()[v]).norm(), kRounding);
  }
}

TEST_P(DeformBy, RigidMotionOfAllBones_MovesTheMeshRigidly) {
  const Skin skin(testing::tube_rig({}));
  const Isometry3d motion = test::odd_motion();
  std::vector<Isometry3d> X_WB = test::bind_poses(skin);
  for (Isometry3d& X : X_WB) X = motion * X;
  const Deformed result = deformed(skin, X_WB, GetParam());
  for (int v = 0; v < skin.vertex_count(); ++v) {
    EXPECT_LT((result.positions[v] - motion * skin.bind_positions()[v]).norm(), 1e-12);
    EXPECT_LT((result.normals[v] - motion.linear() * skin.bind_normals()[v]).norm(), 1e-12);
  }
}

TEST_P(DeformBy, VertexOfOneBone_FollowsIt) {
  const Skin skin(test::cube_rig());
  const Isometry3d motion = test::odd_motion();
  const Deformed result = deformed(skin, {motion}, GetParam());
  for (int v = 0; v < skin.vertex_count(); ++v) {
    EXPECT_LT((result.positions[v] - motion * skin.bind_positions()[v]).norm(), kRounding);
  }
}

TEST_P(DeformBy, WithoutNormals_GivesTheSamePositions) {
  const Skin skin(testing::tube_rig({}));
  const std::vector<Isometry3d> X_WB = test::random_poses(skin, 1.0, 1);
  const Deformed both = deformed(skin, X_WB, GetParam());
  DeformWorkspace workspace(skin);
  std::vector<Vector3d> positions(skin.vertex_count());
  deform(skin, X_WB, GetParam(), workspace, positions);
  EXPECT_EQ(positions, both.positions);
}

TEST_P(DeformBy, SecondCall_DoesNotRememberTheFirst) {
  const Skin skin(testing::tube_rig({}));
  const std::vector<Isometry3d> X_WB = test::random_poses(skin, 1.0, 2);
  DeformWorkspace workspace(skin);
  std::vector<Vector3d> positions(skin.vertex_count());
  deform(skin, test::random_poses(skin, 1.0, 3), GetParam(), workspace, positions);
  deform(skin, X_WB, GetParam(), workspace, positions);
  EXPECT_EQ(positions, deformed(skin, X_WB, GetParam()).positions);
}

TEST(DeformLinear, RandomPoses_AreTheWeightedMeanOfWhatTheBonesMake) {
  const Skin skin(testing::tube_rig({.bones = 6}));
  const std::vector<Isometry3d> X_WB = test::random_poses(skin, 2.0, 4);
  const Deformed result = deformed(skin, X_WB, Blend::kLinear);
  int blended = 0;
  for (int v = 0; v < skin.vertex_count(); ++v) {
    Vector3d mean = Vector3d::Zero();
    for (const auto& [bone, weight] : skin.influences(v)) {
      mean += weight * (X_WB[bone] * (skin.bones()[bone].bind.inverse() * skin.bind_positions()[v]));
    }
    EXPECT_LT((result.positions[v] - mean).norm(), kRounding);
    blended += skin.influences(v).size() >= 3;
  }
  EXPECT_GT(blended, skin.vertex_count() / 2);
}

/// Halfway between bones turned by `angle` against each other the vertex comes nearer to the axis: r cos(angle / 2).
TEST(DeformLinear, TwoBonesHalfAndHalf_GiveTheChordsMiddle) {
  const Vector3d vertex(0.3, 0, 0.1);
  const Skin skin(two_bones(vertex, 0.5));
  for (const double angle : {0.1, 1.0, 2.5}) {
    const Vector3d along(0, 0, 0.2);
    const Deformed result =
        deformed(skin, {Isometry3d::Identity(), Translation3d(along) * turn(angle, Vector3d::UnitZ())}, Blend::kLinear);
    const double r = 0.3 * std::cos(0.5 * angle);
    const Vector3d expected(r * std::cos(0.5 * angle), r * std::sin(0.5 * angle), 0.2);
    EXPECT_LT((result.positions[0] - expected).norm(), kRounding) << angle;
  }
}

/// Halfway along a screw motion: half the turn and half the way along the axis.
TEST(DeformDualQuaternion, TwoBonesHalfAndHalf_GiveHalfTheScrewMotion) {
  const Vector3d vertex(0.3, 0.4, 0.1);
  const Skin skin(two_bones(vertex, 0.5));
  const Vector3d axis = Vector3d(1, -1, 2).normalized();
  const Translation3d to_axis(0.2, 0.1, -0.4);
  const auto screw = [&](double part, double angle) {
    return to_axis * Translation3d(part * 0.3 * axis) * turn(part * angle, axis) * to_axis.inverse();
  };
  for (const double angle : {0.1, 1.0, 2.5, 3.1}) {
    const Deformed result = deformed(skin, {Isometry3d::Identity(), screw(1.0, angle)}, Blend::kDualQuaternion);
    EXPECT_LT((result.positions[0] - screw(0.5, angle) * vertex).norm(), kRounding) << angle;
  }
}

/// 150 and -150 degrees are 60 degrees apart, by way of 180: the quaternions of the two point away from each other.
TEST(DeformDualQuaternion, BonesFarApart_AreBlendedTheShortWay) {
  const Vector3d vertex(0.3, 0, 0.1);
  const Skin skin(two_bones(vertex, 0.5));
  const double angle = 150.0 / 180.0 * kPi;
  const Deformed result =
      deformed(skin, {turn(angle, Vector3d::UnitZ()), turn(-angle, Vector3d::UnitZ())}, Blend::kDualQuaternion);
  EXPECT_LT((result.positions[0] - Vector3d(-0.3, 0, 0.1)).norm(), kRounding);
}

/// The turn of a blend d = w q_0 + (1 - w) q_1 about one axis: tan(turn / 2) = (1 - w) s / (w + (1 - w) c).
TEST(DeformDualQuaternion, UnequalWeights_GiveTheNormalisedBlend) {
  const Vector3d vertex(0.3, 0, 0.1);
  const Skin skin(two_bones(vertex, 0.75));
  const double angle = 2.0;
  const Deformed result =
      deformed(skin, {Isometry3d::Identity(), turn(angle, Vector3d::UnitZ())}, Blend::kDualQuaternion);
  const double blended = 2.0 * std::atan2(0.25 * std::sin(0.5 * angle), 0.75 + 0.25 * std::cos(0.5 * angle));
  EXPECT_LT((result.positions[0] - turn(blended, Vector3d::UnitZ()) * vertex).norm(), kRounding);
}

/// A vertex normal to the axis keeps its direction from it, whatever becomes of the distance.
TEST_P(DeformBy, HalfAndHalf_TurnsTheNormalHalfWay) {
  Rig rig = two_bones({0.3, 0, 0}, 0.5);
  for (const Vector3d& other : {Vector3d(0.3, 0, 0.1), Vector3d(0.3, -0.1, 0)}) {
    rig.meshes[0].vertices.push_back(other);
    rig.meshes[0].influences.push_back(rig.meshes[0].influences[0]);
  }
  rig.meshes[0].triangles.emplace_back(0, 2, 1);
  if (Skin(rig).bind_normals()[0].x() < 0.0) std::swap(rig.meshes[0].triangles[0][1], rig.meshes[0].triangles[0][2]);
  const Deformed result = deformed(Skin(rig), {Isometry3d::Identity(), turn(2.0, Vector3d::UnitZ())}, GetParam());
  EXPECT_LT((result.normals[0] - Vector3d(std::cos(1.0), std::sin(1.0), 0)).norm(), kRounding);
}

/// Area that a ring of the tube encloses, projected on the plane across z [m^2].
double ring_area(const testing::Tube& tube, const std::vector<Vector3d>& positions, int ring) {
  double twice = 0.0;
  for (int k = 0; k < tube.sides; ++k) {
    const Vector3d& a = positions[testing::tube_vertex(tube, ring, k)];
    const Vector3d& b = positions[testing::tube_vertex(tube, ring, (k + 1) % tube.sides)];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

/// The candy wrapper: one bone turned by half a turn against the other. Linear blending scales a ring whose weights are
/// w and 1 - w by |w - (1 - w)|, to nothing halfway; dual quaternions turn it and keep its area.
TEST(Deform, HalfATwist_CollapsesLinearBlendAndKeepsTheVolumeOfDualQuaternions) {
  const testing::Tube tube{.bones = 2, .sides = 20};
  const Skin skin(testing::tube_rig(tube));
  std::vector<Isometry3d> X_WB = test::bind_poses(skin);
  X_WB[1] = turn(kPi, Vector3d::UnitZ()) * X_WB[1];
  const Deformed linear = deformed(skin, X_WB, Blend::kLinear);
  const Deformed dual = deformed(skin, X_WB, Blend::kDualQuaternion);
  const double whole = 0.5 * tube.sides * tube.radius * tube.radius * std::sin(2.0 * kPi / tube.sides);
  for (int ring = 0; ring < testing::tube_rings(tube); ++ring) {
    const auto influences = skin.influences(testing::tube_vertex(tube, ring, 0));
    const double scale = influences.size() == 2 ? influences[0].weight - influences[1].weight : 1.0;
    EXPECT_NEAR(ring_area(tube, dual.positions, ring), whole, 1e-15) << ring;
    EXPECT_NEAR(ring_area(tube, linear.positions, ring), scale * scale * whole, 1e-15) << ring;
  }
  const int middle = tube.rings_per_bone;
  EXPECT_NEAR(ring_area(tube, linear.positions, middle), 0.0, 1e-15);
  EXPECT_LT(linear.normals[testing::tube_vertex(tube, middle, 3)].norm(), 1.0 + kRounding);  // 0 or unit, no NaN
}

}  // namespace
}  // namespace layfigure::skinning
