// The problems that the benchmark makes are those of the step, and Bullet's solvers are given the same ones.
#include "contact_problem.h"

#include <gtest/gtest.h>

#include "bullet_mlcp.h"
#include "touching_scenes.h"

namespace layfigure::bench {
namespace {

using dynamics::LcpStatus;

RestingScene cubes(int count) {
  RestingScene resting{"cubes", testing::stack(count, 0.0, 0.5), {}};
  resting.state = dynamics::initial_state(dynamics::Model(resting.definition.model));
  return resting;
}

Eigen::VectorXd solution(const ContactProblem& problem) {
  dynamics::LcpWorkspace workspace;
  Eigen::VectorXd impulses = Eigen::VectorXd::Zero(problem.size());
  const auto report = solve_lcp(problem.delassus, problem.bias, problem.rows, impulses, workspace);
  EXPECT_EQ(report.status, LcpStatus::kSolved);
  return impulses;
}

TEST(ContactProblem, CubesThatRest_AreCarriedByTheirImpulses) {
  const ContactProblem problem = contact_problems(cubes(3), 1).front();
  ASSERT_EQ(problem.size(), 36);
  const Eigen::VectorXd impulses = solution(problem);
  // The four contacts below each cube carry it and those above it for a step of 2 ms.
  double carried = 0.0;
  for (int k = 0; k < 12; ++k) carried += impulses[3 * k];
  EXPECT_NEAR(carried, (3.0 + 2.0 + 1.0) * 9.81 * 2e-3, 1e-9);
}

TEST(ContactProblem, WithoutFriction_KeepsTheNormalRows) {
  const ContactProblem problem = contact_problems(cubes(2), 1).front();
  const ContactProblem smooth = frictionless(problem);
  ASSERT_EQ(smooth.size(), 8);
  EXPECT_EQ(smooth.delassus(1, 2), problem.delassus(3, 6));
  EXPECT_EQ(smooth.bias[7], problem.bias[21]);
  EXPECT_LE(unilateral_residual(smooth, solution(smooth)), dynamics::kLcpTolerance);
  EXPECT_GE(unilateral_residual(smooth, Eigen::VectorXd::Zero(8)), 0.1);
}

TEST(ContactProblem, WarmStart_FindsContactsByTheirKeys) {
  const ContactProblem last = contact_problems(cubes(1), 1).front();
  ContactProblem next = last;
  std::swap(next.keys[0], next.keys[3]);
  next.keys[1] = 12345;
  const Eigen::VectorXd impulses = Eigen::VectorXd::LinSpaced(12, 1.0, 12.0);
  const Eigen::VectorXd start = warm_start(last, impulses, next);
  EXPECT_EQ(start.segment(0, 3), impulses.segment(9, 3));
  EXPECT_EQ(start.segment(3, 3), Eigen::Vector3d::Zero());
  EXPECT_EQ(start.segment(6, 3), impulses.segment(6, 3));
}

TEST(BulletMlcp, OneCube_IsCarriedToSinglePrecision) {
  // One contact alone: a matrix that every solver can do.
  ContactProblem problem = frictionless(contact_problems(cubes(1), 1).front());
  problem.delassus = problem.delassus.topLeftCorner(1, 1).eval();
  problem.bias = problem.bias.head(1).eval();
  problem.rows.resize(1);
  for (const BulletMlcp solver : kBulletMlcps) {
    const BulletAnswer answer = solve_by_bullet(solver, problem);
    EXPECT_TRUE(answer.claimed) << name_of(solver);
    EXPECT_LE(unilateral_residual(problem, answer.impulses), 1e-5) << name_of(solver);
    EXPECT_GT(answer.cpu_seconds, 0.0);
  }
}

}  // namespace
}  // namespace layfigure::bench
