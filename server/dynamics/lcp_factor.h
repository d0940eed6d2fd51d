#pragma once

#include <algorithm>
#include <vector>

#include "layfigure/math/lanes.h"

namespace layfigure::dynamics::lcp {

using Vector = std::vector<double>;

constexpr int kPack = math::LaneTraits<math::Lanes4>::kCount;
[[nodiscard]] constexpr int packs_of(int size) { return (size + kPack - 1) / kPack; }
[[nodiscard]] constexpr int whole_packs(int size) { return packs_of(size) * kPack; }

/// A dense system solved in place. Column-major, each column in whole packs of four, of which the last is filled up
/// with zeros: every inner loop runs down columns, pack by pack, so it reorders no sum and leaves no rest. Packs of
/// zeros cost next to nothing, and so the rows of bodies that have little to do with each other: a stack's time grows
/// with its height, not with the cube of it. Sizes are those of the last resize(); memory only grows.
class System {
 public:
  void reserve(int size);
  void resize(int size);

  [[nodiscard]] double* column(int k) { return numbers_of(k * packs_); }
  /// Column k is zero up to row `first`. Not needed where only the lower triangle is read.
  void begin_column(int k, int first) {
    double* const entries = column(k);
    for (int i = 0; i < first; ++i) entries[i] = 0.0;
  }
  /// Column k is zero from row `end` on. Call once for each column.
  void end_column(int k, int end) {
    double* const entries = column(k);
    for (int i = end; i < packs_ * kPack; ++i) entries[i] = 0.0;
    if (k < size_) ends_[k / kPack] = std::max(ends_[k / kPack], whole_packs(end));
  }
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
  std::vector<int> ends_;              ///< for each pack of columns: one past its last row that is not zero
  Vector pivots_;
  std::vector<int> swaps_;
};

}  // namespace layfigure::dynamics::lcp
