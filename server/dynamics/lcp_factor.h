#pragma once

#include <vector>

namespace layfigure::dynamics::lcp {

using Vector = std::vector<double>;

/// A dense system solved in place. Column-major: every inner loop runs down a column, so it vectorises without
/// reordering a sum. Sizes are those of the last resize(); memory only grows.
class System {
 public:
  void reserve(int size);
  void resize(int size);

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] double* column(int k) { return matrix_.data() + static_cast<std::size_t>(k) * size_; }
  [[nodiscard]] Vector& rhs() { return rhs_; }

  /// Solves by L D L^T; reads the lower triangle. A pivot below `least_pivot` (> 0) is rounding, and raised to it.
  void solve_symmetric(double least_pivot);
  /// Solves by L U with partial pivoting; pivots likewise, by magnitude.
  void solve_general(double least_pivot);

 private:
  void swap_rows(int i, int k);
  void eliminate_right_of(int k);

  int size_{0};
  Vector matrix_;
  Vector rhs_;
};

}  // namespace layfigure::dynamics::lcp
