#include "normals.h"

#include <gtest/gtest.h>

#include <cmath>

namespace layfigure::character {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

TEST(NormalMap, OfAnyMap_KeepsNormalsNormalToTheirPlane) {
  Matrix3d linear;
  linear << 1.0, 0.3, -0.2, 0.1, 2.0, 0.4, 0.0, -0.5, 0.7;
  for (const double sign : {1.0, -1.0}) {  // also mirrored
    const Matrix3d map = sign * linear;
    const Vector3d a(1, 2, 3);
    const Vector3d b(-1, 0.5, 2);
    const Vector3d normal = normal_map(map) * a.cross(b);
    EXPECT_NEAR(normal.dot(map * a), 0.0, 1e-12);
    EXPECT_NEAR(normal.dot(map * b), 0.0, 1e-12);
    EXPECT_GT(normal.dot(map * a.cross(b)), 0.0);  // on the side on which it was
  }
}

TEST(NormalMap, OfAFlatMap_IsFinite) {
  const Matrix3d flat = Vector3d(1, 1, 0).asDiagonal();
  EXPECT_EQ((normal_map(flat) * Vector3d(1, 2, 3)).normalized(), Vector3d::UnitZ());
}

TEST(UnitOrZero, HugeTinyAndBrokenNormals_AreUnitOrZero) {
  EXPECT_EQ(unit_or_zero({0, 1e300, 0}), Eigen::Vector3f::UnitY());
  EXPECT_EQ(unit_or_zero({0, 0, -1e-300}), -Eigen::Vector3f::UnitZ());
  EXPECT_EQ(unit_or_zero({0, 0, 0}), Eigen::Vector3f::Zero());
  EXPECT_EQ(unit_or_zero({1, std::nan(""), 0}), Eigen::Vector3f::Zero());
}

}  // namespace
}  // namespace layfigure::character
