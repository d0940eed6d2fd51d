#pragma once

#include <vector>

#include "layfigure/math/lanes.h"

namespace layfigure::dynamics::lcp {

using Vector = std::vector<double>;

/// A dense system solved in place. Column-major, each column in whole packs of four, of which the last is filled up
/// with zeros: every inner loop runs down columns, pack by pack, so it reorders no sum and leaves no rest. Sizes are
/// those of the last resize(); memory only grows.
class System {
 public:
  void reserve(int size);
  void resize(int size);

  [[nodiscard]] double* column(int k) { return numbers_of(k * packs_); }
  [[nodiscard]] double* rhs() { return column(size_); }

  /// Solves by L D L^T; reads the lower triangle. A pivot below `least_pivot` (> 0) is rounding, and raised to it.
  void solve_symmetric(double least_pivot);
  /// Solves by L U with pivoting; pivots likewise, by magnitude.
  void solve_general(double least_pivot);

 private:
  [[nodiscard]] double* numbers_of(int pack) { return reinterpret_cast<double*>(columns_.data() + pack); }

  int size_{0};
  int packs_{0};                       ///< per column
  std::vector<math::Lanes4> columns_;  ///< those of the matrix and the right side
  Vector pivots_;
  std::vector<int> swaps_;
};

}  // namespace layfigure::dynamics::lcp
