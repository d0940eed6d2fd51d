#include "lcp_factor.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "layfigure/math/kernel.h"

namespace layfigure::dynamics::lcp {
namespace {

using math::Lanes4;

// A diagonal entry is the pivot unless it is smaller than this share of the largest: swapping rows takes longer than
// what is lost of the digits.
constexpr double kPivotShare = 0.1;

/// The columns of a system and their length, a multiple of kPack.
struct Columns {
  double* first;
  int size;
  int length;
  int* ends;  ///< of each pack of columns, multiples of kPack: its rows from there on are zero

  [[nodiscard]] double* operator[](int k) const { return first + static_cast<std::ptrdiff_t>(k) * length; }
};

/// y[from..end) -= a x[from..end); `end` is a multiple of kPack.
inline void subtract(double a, const double* x, double* y, int from, int end) {
  for (; from % kPack != 0 && from < end; ++from) y[from] -= a * x[from];
  const Lanes4 factor(a);
  for (int i = from; i < end; i += kPack) math::store(math::load(y + i) - factor * math::load(x + i), y + i);
}

/// Subtracts a[0], a[1], .. times the columns from k on, a pack of them that is zero from `end` on; k, `from` and `end`
/// are multiples of kPack.
inline void subtract_pack(const double* a, const Columns& columns, int k, double* y, int from, int end) {
  const double* const x[kPack] = {columns[k], columns[k + 1], columns[k + 2], columns[k + 3]};
  const Lanes4 factor[kPack] = {a[0], a[1], a[2], a[3]};
  for (int i = from; i < end; i += kPack) {
    const Lanes4 some = factor[0] * math::load(x[0] + i) + factor[1] * math::load(x[1] + i);
    const Lanes4 more = factor[2] * math::load(x[2] + i) + factor[3] * math::load(x[3] + i);
    math::store(math::load(y + i) - (some + more), y + i);
  }
}

inline bool is_zero(const double* pack) { return pack[0] == 0.0 && pack[1] == 0.0 && pack[2] == 0.0 && pack[3] == 0.0; }

/// y = L^-1 y as far as the first `count` columns of L are known; its diagonal is 1. y is zero from `end` on; returns
/// where it is afterwards.
inline int eliminate(const Columns& L, int count, double* y, int end) {
  const int* end_of_pack = L.ends;
  int k = 0;
  for (; k + kPack <= count; k += kPack, ++end_of_pack) {
    if (is_zero(y + k)) continue;
    end = std::max(end, *end_of_pack);
    const double* const x[kPack - 1] = {L[k] + k, L[k + 1] + k, L[k + 2] + k};
    double a[kPack];  // in registers: entries that are written one by one and read as a pack stall the processor
    a[0] = y[k];
    a[1] = y[k + 1] - a[0] * x[0][1];
    a[2] = y[k + 2] - a[0] * x[0][2] - a[1] * x[1][2];
    a[3] = y[k + 3] - a[0] * x[0][3] - a[1] * x[1][3] - a[2] * x[2][3];
    subtract_pack(a, L, k, y, k + kPack, *end_of_pack);
    for (int i = 1; i < kPack; ++i) y[k + i] = a[i];
  }
  if (k == count) return end;
  end = std::max(end, *end_of_pack);
  for (; k < count; ++k) subtract(y[k], L[k], y, k + 1, *end_of_pack);
  return end;
}

inline void divide_below(double* y, int j, int end, double pivot) {
  const double inverse = 1.0 / pivot;
  int i = j + 1;
  for (; i % kPack != 0; ++i) y[i] *= inverse;
  for (; i < end; i += kPack) math::store(math::load(y + i) * Lanes4(inverse), y + i);
}

/// Column by column: each is made of the finished ones on its left.
LAYFIGURE_KERNEL
void solve_by_squares(const Columns& columns, double least_pivot, double* pivots) {
  for (int j = 0; j < columns.size; ++j) {
    double* y = columns[j];
    int end = columns.ends[j / kPack];
    const int* end_of_pack = columns.ends;
    int k = 0;
    for (; k + kPack <= j; k += kPack, ++end_of_pack) {
      if (*end_of_pack <= j) continue;
      double a[kPack];
      for (int i = 0; i < kPack; ++i) a[i] = pivots[k + i] * columns[k + i][j];
      if (is_zero(a)) continue;
      end = std::max(end, *end_of_pack);
      subtract_pack(a, columns, k, y, j / kPack * kPack, *end_of_pack);
    }
    for (; k < j; ++k) subtract(pivots[k] * columns[k][j], columns[k], y, j, end);
    columns.ends[j / kPack] = end;
    pivots[j] = y[j] > least_pivot ? y[j] : least_pivot;
    divide_below(y, j, end, pivots[j]);
  }
  double* x = columns[columns.size];
  eliminate(columns, columns.size, x, columns.length);
  for (int k = columns.size - 1; k >= 0; --k) {
    double sum = x[k] / pivots[k];
    const int end = std::min(columns.ends[k / kPack], columns.size);
    for (int i = k + 1; i < end; ++i) sum -= columns[k][i] * x[i];
    x[k] = sum;
  }
}

/// The row of the pivot of column j, which is zero from `end` on.
inline int pivot_row(const double* y, int j, int end) {
  Lanes4 most(0.0);
  for (int i = j / kPack * kPack; i < end; i += kPack) {
    const Lanes4 entries = math::load(y + i);
    most = math::maximum(most, math::maximum(entries, -entries));
  }
  if (math::all(most * Lanes4(kPivotShare) <= Lanes4(std::abs(y[j])))) return j;
  int largest = j;
  for (int i = j + 1; i < end; ++i) {
    if (std::abs(y[i]) > std::abs(y[largest])) largest = i;
  }
  return largest;
}

/// Exchanges row j of a column that is zero from `end` on with row p below it.
inline void swap_rows(double* y, int j, int p, int& end) {
  std::swap(y[j], y[p]);
  if (p >= end && y[p] != 0.0) end = whole_packs(p + 1);
}

LAYFIGURE_KERNEL
void solve_by_elimination(const Columns& columns, double least_pivot, int* swaps) {
  const int n = columns.size;
  int swapped = 0;  // no row from here on has been the first of a swap
  for (int j = 0; j <= n; ++j) {
    double* y = columns[j];
    int end = j < n ? columns.ends[j / kPack] : columns.length;
    for (int k = 0; k < swapped; ++k) {
      if (swaps[k] != k) swap_rows(y, k, swaps[k], end);
    }
    end = eliminate(columns, j, y, end);
    if (j == n) break;
    columns.ends[j / kPack] = end;
    swaps[j] = pivot_row(y, j, end);
    if (swaps[j] != j) {
      swapped = j + 1;
      for (int k = 0; k <= j; ++k) swap_rows(columns[k], j, swaps[j], columns.ends[k / kPack]);
    }
    if (!(std::abs(y[j]) > least_pivot)) y[j] = least_pivot;
    divide_below(y, j, columns.ends[j / kPack], y[j]);
  }
  double* x = columns[n];
  for (int k = n - 1; k >= 0; --k) {
    const double* above = columns[k];
    const double value = x[k] / above[k];
    x[k] = value;
    for (int i = 0; i < k; ++i) x[i] -= value * above[i];
  }
}

}  // namespace

void System::reserve(int size) {
  columns_.reserve(static_cast<std::size_t>(size + 1) * packs_of(size));
  ends_.reserve(packs_of(size));
  pivots_.reserve(size);
  swaps_.reserve(size);
}

void System::resize(int size) {
  size_ = size;
  packs_ = packs_of(size);
  columns_.resize(static_cast<std::size_t>(size + 1) * packs_);
  ends_.assign(packs_, 0);
  pivots_.resize(size);
  swaps_.resize(size);
  end_column(size, size);
}

void System::solve_symmetric(double least_pivot) {
  solve_by_squares({column(0), size_, packs_ * kPack, ends_.data()}, least_pivot, pivots_.data());
}

void System::solve_general(double least_pivot) {
  solve_by_elimination({column(0), size_, packs_ * kPack, ends_.data()}, least_pivot, swaps_.data());
}

}  // namespace layfigure::dynamics::lcp
