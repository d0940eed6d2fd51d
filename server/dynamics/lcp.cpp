#include "layfigure/dynamics/lcp.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "lcp_solver.h"

namespace layfigure::dynamics {
namespace {

// From a cold start most sets need 3 to 12 steps; one that needs more than this mostly cycles.
constexpr int kFastIterations = 12;
// Sets with contacts for which such steps do not go well: steps in succession of the two other ways, and how often
// these take turns. Most sets need 3 to 8 of the first; where one way cycles, the other mostly leads out of its cycle.
constexpr int kPullIterations = 20;
constexpr int kCreepIterations = 10;
constexpr int kTurns = 6;
// A round progresses where it leaves less than this share of the residual. Of rounds that do not, this many in
// succession mean that the impulses drift along a direction in which the bodies jam.
constexpr double kProgress = 0.5;
constexpr int kStalledRounds = 2;
// After a convex round, which finds the active set if it can be found by convexity.
constexpr int kRetryIterations = 8;
// Sets that took more than this were at the edge of having no solution.
constexpr int kRounds = 12;
// Gauss-Seidel sweeps per round, for contacts alone: they come near a solution of the law with slip where the fixed
// point in s wanders.
constexpr int kSweeps = 100;
// e of the proximal rounds: coarse first, which takes long strides. Below the last, differences such as
// c - (v + s) / e lose more digits to rounding than a round gains.
constexpr double kFirstEpsilon = 1e-2;
constexpr double kEpsilonRatio = 1e-2;
constexpr double kLastEpsilon = 1e-6;

/// Whether `ray`, which is overwritten, is one along which (3) without its proximal term falls without end: from
/// (A x + b + s)^T ray >= 0 at a solution x follows |x|_1 >= -(b + s)^T ray / max |A ray|.
bool is_certificate(lcp::Solver& solver, lcp::Vector& ray) {
  lcp::project_recession(solver.problem, ray);
  std::fill(solver.rate.begin(), solver.rate.end(), 0.0);
  lcp::add_product(solver.problem, ray, solver.rate);
  double fall = 0.0;
  double image = 0.0;
  for (int i = 0; i < solver.problem.size; ++i) {
    fall -= (solver.problem.bias[i] + solver.offset[i]) * ray[i];
    image = std::max(image, std::abs(solver.rate[i]));
  }
  return fall > 0.0 && fall >= lcp::kLargestSolution * image;
}

/// The answer to a set without one: every row a little compliant.
void answer_compliantly(lcp::Solver& solver) {
  std::fill(solver.center.begin(), solver.center.end(), 0.0);
  lcp::project(solver.problem, solver.center);
  solver.solve_proximal(kLastEpsilon);
  solver.best = solver.lambda;
  lcp::velocities(solver.problem, solver.best, solver.v);
  solver.best_residual = lcp::natural_residual(solver.problem, solver.best, solver.v);
}

bool has_contacts(const lcp::Problem& problem) {
  return std::any_of(problem.rows.begin(), problem.rows.end(),
                     [](const LcpRow& row) { return row.kind == LcpRowKind::kContact; });
}

/// The law itself, friction and all, from `lambda`; true if that solves it.
bool solve_contacts(lcp::Solver& solver) {
  if (solver.solve_coulomb(kFastIterations, true)) return true;
  solver.keep_iterate();
  for (int turn = 0; turn < kTurns; ++turn) {
    if (solver.solve_by_pulling(kPullIterations) || solver.solve_by_creeping(kCreepIterations)) return true;
  }
  solver.lambda = solver.best;
  return false;
}

/// One convex round from `lambda`, to which its answer goes.
LcpStatus proximal_round(lcp::Solver& solver, double epsilon) {
  solver.center = solver.lambda;
  solver.solve_proximal(epsilon);
  lcp::Vector& ray = solver.target;
  for (int i = 0; i < solver.problem.size; ++i) ray[i] = solver.lambda[i] - solver.center[i];
  if (is_certificate(solver, ray)) return LcpStatus::kInfeasible;
  if (solver.rate_answer() || solver.solve_coulomb(kRetryIterations)) return LcpStatus::kSolved;
  return LcpStatus::kIterationLimit;
}

LcpStatus solve_by_rounds(lcp::Solver& solver, bool contacts) {
  double epsilon = kFirstEpsilon;
  int stalled = 0;
  for (int round = 0; round < kRounds && stalled < kStalledRounds; ++round) {
    const double before = solver.best_residual.value;
    const LcpStatus status = proximal_round(solver, epsilon);
    if (status != LcpStatus::kIterationLimit) return status;
    if (contacts) {
      solver.sweep(kSweeps);
      if (solver.rate_answer() || solver.solve_coulomb(kRetryIterations)) return LcpStatus::kSolved;
      stalled = solver.best_residual.value > kProgress * before ? stalled + 1 : 0;
      lcp::velocities(solver.problem, solver.lambda, solver.v);
      lcp::contact_offsets(solver.problem, solver.v, solver.offset);
    }
    epsilon = std::max(epsilon * kEpsilonRatio, kLastEpsilon);
  }
  return LcpStatus::kIterationLimit;
}

LcpStatus solve(lcp::Solver& solver) {
  solver.start();
  const bool contacts = has_contacts(solver.problem);
  if (contacts ? solve_contacts(solver) : solver.solve_coulomb(kFastIterations)) return LcpStatus::kSolved;
  std::fill(solver.offset.begin(), solver.offset.end(), 0.0);
  const LcpStatus status = solve_by_rounds(solver, contacts);
  if (status == LcpStatus::kInfeasible) answer_compliantly(solver);
  return status;
}

/// lambda of the scaled problem, where it can be of use.
void load_start(const Eigen::Ref<const Eigen::VectorXd>& lambda, lcp::Solver& solver) {
  const lcp::Problem& problem = solver.problem;
  solver.lambda.resize(problem.size);
  for (int i = 0; i < problem.size; ++i) {
    const double start = lambda[i] / (problem.scaling[i] * problem.magnitude);
    solver.lambda[i] = std::abs(start) <= lcp::kLargestSolution ? start : 0.0;
  }
}

void store_answer(const lcp::Solver& solver, std::span<const LcpRow> rows, Eigen::Ref<Eigen::VectorXd> lambda) {
  const lcp::Problem& problem = solver.problem;
  for (int i = 0; i < problem.size; ++i) {
    lambda[i] = solver.best[i] * problem.scaling[i] * problem.magnitude;
    // Scaling back and forth may round across a bound.
    if (rows[i].kind == LcpRowKind::kBox) lambda[i] = std::clamp(lambda[i], rows[i].lower, rows[i].upper);
  }
}

}  // namespace

struct LcpWorkspace::Data {
  lcp::Solver solver;
};

LcpWorkspace::LcpWorkspace() : data_(std::make_unique<Data>()) {}
LcpWorkspace::~LcpWorkspace() = default;
LcpWorkspace::LcpWorkspace(LcpWorkspace&&) noexcept = default;
LcpWorkspace& LcpWorkspace::operator=(LcpWorkspace&&) noexcept = default;

void LcpWorkspace::reserve(int rows) { data_->solver.reserve(rows); }

LcpReport solve_lcp(const Eigen::Ref<const Eigen::MatrixXd>& delassus, const Eigen::Ref<const Eigen::VectorXd>& bias,
                    std::span<const LcpRow> rows, Eigen::Ref<Eigen::VectorXd> lambda, LcpWorkspace& workspace) {
  lcp::Solver& solver = workspace.data().solver;
  const int n = static_cast<int>(rows.size());
  assert(delassus.rows() == n && delassus.cols() == n && bias.size() == n && lambda.size() == n);
  if (n == 0) return {};
  constexpr LcpReport kRefusal{
      .status = LcpStatus::kInvalid, .residual = LcpRow::kInfinity, .worst_row = 0, .iterations = 0};
  if (!lcp::set_up(delassus, bias, rows, solver.problem)) {
    lambda.setZero();
    return kRefusal;
  }
  load_start(lambda, solver);
  const LcpStatus status = solve(solver);
  store_answer(solver, rows, lambda);
  // Where rounding made the matrix of very stiff joints negative there may be no answer at all.
  if (!lambda.allFinite()) {
    lambda.setZero();
    return kRefusal;
  }
  return {.status = status,
          .residual = solver.best_residual.value,
          .worst_row = solver.best_residual.row,
          .iterations = solver.iterations};
}

}  // namespace layfigure::dynamics
