#pragma once

#include "lcp_newton.h"

namespace layfigure::dynamics::lcp {

/// Scaled size of a solution beyond which a set counts as infeasible.
constexpr double kLargestSolution = 1e7;

/// The methods of lcp.h on one problem, and their scratch. All vectors have the problem's size.
struct Solver {
  Problem problem;
  ReducedSystem step;
  Vector lambda;  ///< in K: the start, then the latest answer
  Vector y;       ///< the iterate, not necessarily in K
  Vector v;       ///< A y + b, and the pull to c in a round on the law
  Vector offset;  ///< s
  Vector center;  ///< c of a proximal round
  Vector target;  ///< P_K(c - (v + s) / e)
  Vector rate;    ///< A dy
  Vector pull;    ///< e of each row in a Newton step on the law
  Vector base;    ///< y before a step
  Vector best;    ///< in K: the iterate of least residual so far
  Residual best_residual;
  int iterations{0};

  void reserve(int rows);
  /// Sizes the scratch to the problem and takes `lambda`, projected, as the best iterate.
  void start();

  /// Newton's method on the law (1) from `lambda`, at most `limit` steps, or none after one that does not halve the
  /// residual. True: `lambda` is the answer; else it is as it was.
  [[nodiscard]] bool solve_coulomb(int limit, bool while_halved = false);
  /// After that: goes on from the last iterate if that is nearer to an answer.
  void keep_iterate();
  /// Rounds of the proximal-point method on the law, equation (2), from `lambda`, until they have taken `limit` steps.
  /// True: `lambda` is the answer; else it is where they ended, in K.
  [[nodiscard]] bool solve_by_pulling(int limit);
  /// Newton's method likewise, each step pulled to where it begins, the lightly loaded contacts the most.
  [[nodiscard]] bool solve_by_creeping(int limit);
  /// Minimises the convex problem (3) with this e about `center` with `offset`; the answer, in K, goes to `lambda`.
  void solve_proximal(double epsilon);
  /// Improves `lambda` by block Gauss-Seidel sweeps over the laws, contacts whole.
  void sweep(int count);

  /// Compares `lambda`, unless it is too large, with `best`; true if it solves the problem.
  bool rate_answer();

 private:
  [[nodiscard]] double residual_here();
  [[nodiscard]] double residual_of_step(double length);
  [[nodiscard]] double take_step(double residual);
  [[nodiscard]] bool accept();
  [[nodiscard]] bool polish_and_accept(double residual);
  [[nodiscard]] bool end_at_iterate(double residual);
  [[nodiscard]] double pulled_residual(double epsilon);
  [[nodiscard]] bool solve_round(double epsilon, double wanted);
  void pull_by_load(double residual);
  void relax(int row, int count);
  [[nodiscard]] double proximal_gap(double epsilon);
  [[nodiscard]] double slope_at(double epsilon, double length);
  [[nodiscard]] double search_line(double epsilon);
  void advance(double length);
};

}  // namespace layfigure::dynamics::lcp
