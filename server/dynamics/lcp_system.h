#pragma once

#include "lcp_factor.h"
#include "lcp_problem.h"

namespace layfigure::dynamics::lcp {

/// A direction in which a Newton step moves: a column of U and of W, and its entries of E and r (lcp_newton.h).
struct Direction {
  int row;    ///< first row
  int count;  ///< 1 or 3 rows
  double u[3];
  double w[3];
  double compliance;  ///< E
  double rhs;         ///< r
};

/// The small system of a Newton step,  dy = g + U x,  (E + W^T A U) x = r - W^T A g.
class ReducedSystem {
 public:
  void reserve(int rows);
  /// Empties the system for a problem of that many rows; allocates where there were never as many.
  void clear(int rows);

  /// A row that is free: U = W = its unit vector.
  void add_free_row(int row, double compliance, double rhs);
  void add(const Direction& direction);
  /// Adds to g.
  void jump(int row, double change);

  /// Solves it; the answer is change().
  void solve(const Problem& problem);
  [[nodiscard]] const Vector& change() const { return change_; }

 private:
  void subtract_jump(const Problem& problem);
  [[nodiscard]] Extent directions_in(const Extent& rows) const;
  void fill_column(const Problem& problem, int k);

  std::vector<Direction> directions_;
  std::vector<int> rows_;      ///< first rows of the directions, ascending
  std::vector<int> combined_;  ///< directions of which W takes more than the first row, ascending
  Vector change_;
  Vector product_;
  System system_;
  bool jumps_{false};
  bool symmetric_{true};  ///< W = U
};

}  // namespace layfigure::dynamics::lcp
