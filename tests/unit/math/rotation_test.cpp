#include "layfigure/math/rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace layfigure::math {
namespace {

// A few units in the last place of the largest number that goes in.
constexpr double kRounding = 2e-15;

const Eigen::Vector3d kAxis = Eigen::Vector3d(1.0, -2.0, 3.0).normalized();

TEST(ExpRotation, AnyAngle_AgreesWithAngleAxis) {
  for (double angle = 0.0; angle < 10.0; angle += 0.0173) {
    const Eigen::Quaterniond expected(Eigen::AngleAxisd(angle, kAxis));
    EXPECT_LT((exp_rotation(angle * kAxis).coeffs() - expected.coeffs()).norm(), kRounding) << angle;
  }
}

TEST(LogRotation, OfExp_GivesTheVectorBackToRounding) {
  for (double angle = 1e-300; angle < std::numbers::pi; angle = angle * 1.5 + 1e-3) {
    const Eigen::Vector3d v = angle * kAxis;
    EXPECT_LT((log_rotation(exp_rotation(v)) - v).norm(), kRounding * std::max(1.0, angle)) << angle;
  }
}

TEST(LogRotation, SeriesAndLibrary_MeetAtTheLimit) {
  for (const double angle : {std::numbers::pi / 3 - 1e-12, std::numbers::pi / 3 + 1e-12}) {
    EXPECT_NEAR(log_rotation(Eigen::Quaterniond(Eigen::AngleAxisd(angle, kAxis))).norm(), angle, kRounding);
  }
}

TEST(LogRotation, NegatedQuaternion_GivesTheSame) {
  for (const double angle : {0.3, 1.2, 2.9}) {
    const Eigen::Quaterniond q = exp_rotation(angle * kAxis);
    const Eigen::Quaterniond negated(-q.w(), -q.x(), -q.y(), -q.z());
    EXPECT_EQ(log_rotation(q), log_rotation(negated));
  }
}

TEST(LogRotation, HalfTurn_HasLengthPi) {
  EXPECT_NEAR(log_rotation(Eigen::Quaterniond(0.0, kAxis.x(), kAxis.y(), kAxis.z())).norm(), std::numbers::pi,
              kRounding);
}

TEST(LogRotation, Identity_IsZero) {
  EXPECT_EQ(log_rotation(Eigen::Quaterniond::Identity()), Eigen::Vector3d::Zero());
  EXPECT_EQ(exp_rotation(Eigen::Vector3d::Zero()).coeffs(), Eigen::Quaterniond::Identity().coeffs());
}

}  // namespace
}  // namespace layfigure::math
