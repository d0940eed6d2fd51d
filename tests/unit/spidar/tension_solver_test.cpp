#include "layfigure/spidar/tension_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "devices.h"

namespace layfigure::spidar {
namespace {

using Matrix68 = Eigen::Matrix<double, 6, kStrings>;

constexpr double kDegrees = std::numbers::pi / 180.0;
constexpr double kReference = 2.0;  // [N]
// What the solver weighs torques by (tension_solver.h).
constexpr double kTorqueShare = 0.1;

Matrix68 wrench_matrix(const Geometry& geometry, const Pose& pose) {
  return -length_jacobian(geometry, pose).transpose();
}

/// In newtons, as the solver weighs it.
double weighted_error(const Geometry& geometry, const Wrench& got, const Wrench& wanted) {
  Wrench error = got - wanted;
  error.tail<3>() *= kTorqueShare / geometry.grip_radius();
  return error.norm();
}

/// The least weighted error there is, by very many steps of projected gradients.
double least_error(const Geometry& geometry, const Pose& pose, const Wrench& wanted) {
  Matrix68 W = wrench_matrix(geometry, pose);
  Wrench w = wanted;
  W.bottomRows<3>() *= kTorqueShare / geometry.grip_radius();
  w.tail<3>() *= kTorqueShare / geometry.grip_radius();
  const double step = 1.0 / (W * W.transpose()).norm();
  Tensions t = Tensions::Constant(kReference), ahead = t;
  double momentum = 1.0;
  for (int k = 0; k < 8000; ++k) {
    const Tensions next = (ahead - step * W.transpose() * (W * ahead - w))
                              .cwiseMax(geometry.least_tension)
                              .cwiseMin(geometry.most_tension);
    const double grown = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * momentum * momentum));
    ahead = next + (momentum - 1.0) / grown * (next - t);
    t = next;
    momentum = grown;
  }
  return (W * t - w).norm();
}

void expect_in_range(const Geometry& geometry, const Tensions& tensions) {
  EXPECT_GE(tensions.minCoeff(), geometry.least_tension);
  EXPECT_LE(tensions.maxCoeff(), geometry.most_tension);
}

TEST(TensionSolver, NothingAsked_TheReferenceOnEveryStringOrNear) {
  const Geometry geometry = test::device("g6x3");
  const TensionSolution solution = TensionSolver(geometry, kReference).solve({}, Wrench::Zero());
  EXPECT_TRUE(solution.exact);
  EXPECT_LT(solution.wrench.norm(), 1e-12);
  EXPECT_NEAR(solution.tensions.mean(), kReference, 0.25 * kReference);
}

TEST(TensionSolver, WrenchesThatCanBeHad_AreExact) {
  for (const char* name : test::kDevices) {
    const Geometry geometry = test::device(name);
    const TensionSolver solver(geometry, kReference);
    test::Dice dice(11);
    int exact = 0;
    for (int trial = 0; trial < 20000; ++trial) {
      const Pose pose = dice.pose(0.02, 25.0 * kDegrees);
      // Made from tensions in the range, so that they can be had.
      Tensions t;
      for (int i = 0; i < kStrings; ++i) t[i] = dice.between(geometry.least_tension, geometry.most_tension);
      const Wrench wanted = wrench_matrix(geometry, pose) * t;
      const TensionSolution solution = solver.solve(pose, wanted);
      exact += solution.exact ? 1 : 0;
      expect_in_range(geometry, solution.tensions);
      EXPECT_LT((solution.wrench - wanted).norm(), 1e-9) << name << " " << trial;
    }
    EXPECT_EQ(exact, 20000) << name;
  }
}

TEST(TensionSolver, WrenchesThatCanBeHad_ByTheTensionsNearestToTheReference) {
  const Geometry geometry = test::device("g6x3");
  const TensionSolver solver(geometry, kReference);
  test::Dice dice(12);
  for (int trial = 0; trial < 500; ++trial) {
    const Pose pose = dice.pose(0.02, 25.0 * kDegrees);
    const Wrench wanted = dice.wrench(4.0, 0.05);
    const TensionSolution solution = solver.solve(pose, wanted);
    if (!solution.exact) continue;
    const double distance = (solution.tensions.array() - kReference).matrix().norm();
    // No other tensions in the range with the same wrench are nearer: tried around the solution and far from it.
    const Eigen::FullPivLU<Matrix68> lu(wrench_matrix(geometry, pose));
    const Eigen::MatrixXd null = lu.kernel();
    for (int other = 0; other < 200; ++other) {
      const Eigen::Vector2d z(dice.between(-1.0, 1.0), dice.between(-1.0, 1.0));
      const Tensions t = solution.tensions + std::pow(10.0, dice.between(-6.0, 1.0)) * null * z;
      if (t.minCoeff() < geometry.least_tension || t.maxCoeff() > geometry.most_tension) continue;
      EXPECT_GE((t.array() - kReference).matrix().norm(), distance - 1e-9);
    }
  }
}

TEST(TensionSolver, WrenchesBeyondTheDevice_AsNearAsCanBe) {
  for (const char* name : test::kDevices) {
    const Geometry geometry = test::device(name);
    const TensionSolver solver(geometry, kReference);
    test::Dice dice(13);
    int beyond = 0;
    for (int trial = 0; trial < 30; ++trial) {
      const Pose pose = dice.pose(0.03, 40.0 * kDegrees);
      const Wrench wanted = dice.wrench(80.0, 2.0);
      const TensionSolution solution = solver.solve(pose, wanted);
      if (solution.exact) continue;
      ++beyond;
      expect_in_range(geometry, solution.tensions);
      const double error = weighted_error(geometry, solution.wrench, wanted);
      EXPECT_LT(error, least_error(geometry, pose, wanted) + 1e-6 * wanted.norm()) << name << " " << trial;
    }
    EXPECT_GT(beyond, 5) << name;
  }
}

TEST(TensionSolver, ManyTicks_AllEndAndStayInTheRange) {
  const Geometry geometry = test::device("g6x4");
  const TensionSolver solver(geometry, kReference);
  test::Dice dice(14);
  int most = 0;
  for (int trial = 0; trial < 50000; ++trial) {
    const TensionSolution solution = solver.solve(dice.pose(0.05, 60.0 * kDegrees), dice.wrench(60.0, 1.0));
    most = std::max(most, solution.pivots);
    ASSERT_TRUE(solution.tensions.allFinite());
    ASSERT_GE(solution.tensions.minCoeff(), geometry.least_tension);
    ASSERT_LE(solution.tensions.maxCoeff(), geometry.most_tension);
  }
  EXPECT_LT(most, TensionSolver::kMostPivots / 2);
}

TEST(TensionSolver, AcrossTheBorder_NothingJumps) {
  const Geometry geometry = test::device("g6x3");
  const TensionSolver solver(geometry, kReference);
  test::Dice dice(15);
  constexpr double kStep = 2e-3;  // [N]
  int borders = 0;
  for (int path = 0; path < 6; ++path) {
    const Pose pose = dice.pose(0.02, 30.0 * kDegrees);
    Wrench along = dice.wrench(1.0, 0.02);
    along.head<3>().normalize();
    TensionSolution last = solver.solve(pose, Wrench::Zero());
    for (double force = kStep; force < 40.0; force += kStep) {
      const TensionSolution now = solver.solve(pose, force * along);
      borders += now.exact != last.exact ? 1 : 0;
      // Condition of the strings' wrenches, some tens in the frame.
      ASSERT_LT((now.tensions - last.tensions).norm(), 200.0 * kStep) << path << " at " << force << " N";
      last = now;
    }
  }
  EXPECT_GE(borders, 4);
}

TEST(TensionSolver, FromTheLastTick_TheSameTensionsInFewerPivots) {
  const Geometry geometry = test::device("g6x3");
  const TensionSolver solver(geometry, kReference);
  test::Dice dice(16);
  long cold_pivots = 0, warm_pivots = 0;
  for (int path = 0; path < 50; ++path) {
    const Pose pose = dice.pose(0.02, 30.0 * kDegrees);
    const Wrench from = dice.wrench(60.0, 1.0), change = dice.wrench(0.1, 0.002);
    TensionSolution last = solver.solve(pose, from);
    for (int tick = 1; tick < 100; ++tick) {
      const Wrench wanted = from + tick * change;
      const TensionSolution cold = solver.solve(pose, wanted);
      const TensionSolution warm = solver.solve(pose, wanted, last);
      // Rounding, by the condition of the regularised problem.
      ASSERT_LT((warm.tensions - cold.tensions).norm(), 1e-5) << path << " " << tick;
      ASSERT_LT((warm.wrench - cold.wrench).norm(), 1e-6) << path << " " << tick;
      cold_pivots += cold.pivots;
      warm_pivots += warm.pivots;
      last = warm;
    }
  }
  EXPECT_LT(warm_pivots, cold_pivots / 4);
}

TEST(TensionSolver, WrenchThatIsNotFinite_TheReference) {
  const Geometry geometry = test::device("g6x3");
  Wrench wrench = Wrench::Zero();
  wrench[2] = std::numeric_limits<double>::infinity();
  const TensionSolution solution = TensionSolver(geometry, kReference).solve({}, wrench);
  EXPECT_FALSE(solution.exact);
  EXPECT_EQ(solution.tensions, Tensions::Constant(kReference));
}

TEST(TensionSolver, ReferenceOutOfTheRange_Refused) {
  const Geometry geometry = test::device("g6x3");
  EXPECT_THROW(TensionSolver(geometry, 0.1), GeometryError);
  EXPECT_THROW(TensionSolver(geometry, std::numeric_limits<double>::quiet_NaN()), GeometryError);
}

}  // namespace
}  // namespace layfigure::spidar
