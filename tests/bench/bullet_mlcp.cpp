#include "bullet_mlcp.h"

#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btLemkeSolver.h>
#include <BulletDynamics/MLCPSolvers/btSolveProjectedGaussSeidel.h>

#include <memory>

#include "cpu_time.h"

namespace layfigure::bench {
namespace {

// Bullet's default, and as many as a patient user would allow.
constexpr int kSweeps = 10;
constexpr int kManySweeps = 1000;
// Bullet's own infinity for the upper bounds of normal rows.
constexpr btScalar kNoBound = 1e10F;

std::unique_ptr<btMLCPSolverInterface> make_solver(BulletMlcp solver) {
  switch (solver) {
    case BulletMlcp::kDantzig:
      return std::make_unique<btDantzigSolver>();
    case BulletMlcp::kLemke:
      return std::make_unique<btLemkeSolver>();
    default:
      return std::make_unique<btSolveProjectedGaussSeidel>();
  }
}

/// Bullet's form: v = A x - b.
struct BulletProblem {
  explicit BulletProblem(const ContactProblem& problem) {
    const int n = problem.size();
    A.resize(n, n);
    for (btVectorXu* vector : {&b, &x, &lower, &upper}) vector->resize(n);
    for (int i = 0; i < n; ++i) {
      b[i] = static_cast<btScalar>(-problem.bias[i]);
      lower[i] = 0;
      upper[i] = kNoBound;
      dependencies.push_back(-1);
      for (int j = 0; j < n; ++j) A.setElem(i, j, static_cast<btScalar>(problem.delassus(i, j)));
    }
  }

  btMatrixXu A;
  btVectorXu b, x, lower, upper;
  btAlignedObjectArray<int> dependencies;
};

}  // namespace

std::string name_of(BulletMlcp solver) {
  switch (solver) {
    case BulletMlcp::kDantzig:
      return "Bullet Dantzig";
    case BulletMlcp::kLemke:
      return "Bullet Lemke";
    case BulletMlcp::kGaussSeidel:
      return "Bullet Gauss-Seidel, " + std::to_string(kSweeps) + " sweeps";
    default:
      return "Bullet Gauss-Seidel, " + std::to_string(kManySweeps) + " sweeps";
  }
}

BulletAnswer solve_by_bullet(BulletMlcp solver, const ContactProblem& problem) {
  BulletProblem bullet(problem);
  const std::unique_ptr<btMLCPSolverInterface> mlcp = make_solver(solver);
  const int sweeps = solver == BulletMlcp::kLongGaussSeidel ? kManySweeps : kSweeps;
  BulletAnswer answer;
  answer.cpu_seconds = cpu_seconds_of([&] {
    bullet.x.setZero();
    answer.claimed =
        mlcp->solveMLCP(bullet.A, bullet.b, bullet.x, bullet.lower, bullet.upper, bullet.dependencies, sweeps);
  });
  answer.impulses.resize(problem.size());
  for (int i = 0; i < problem.size(); ++i) answer.impulses[i] = bullet.x[i];
  return answer;
}

}  // namespace layfigure::bench
