#include "lcp_factor.h"

#include <cmath>
#include <utility>

#include "layfigure/math/kernel.h"

namespace layfigure::dynamics::lcp {
namespace {

using math::Lanes4;

constexpr int kPack = math::LaneTraits<Lanes4>::kCount;
// A diagonal entry is the pivot unless it is smaller than this share of the largest: swapping rows takes longer than
// what is lost of the digits.
constexpr double kPivotShare = 0.1;

constexpr int packs_of(int size) { return (size + kPack - 1) / kPack; }

/// The columns of a system and their length, a multiple of kPack.
struct Columns {
  double* first;
  int size;
  int length;

  [[nodiscard]] double* operator[](int k) const { return first + static_cast<std::ptrdiff_t>(k) * length; }
};

/// y[from..) -= a x[from..)
inline void subtract(double a, const double* x, double* y, int from, int length) {
  for (; from % kPack != 0 && from < length; ++from) y[from] -= a * x[from];
  const Lanes4 factor(a);
  for (int i = from; i < length; i += kPack) math::store(math::load(y + i) - factor * math::load(x + i), y + i);
}

/// Subtracts a[0], a[1], .. times the columns from k on, a pack of them; k and `from` are multiples of kPack.
inline void subtract_pack(const double* a, const Columns& columns, int k, double* y, int from) {
  const double* const x[kPack] = {columns[k], columns[k + 1], columns[k + 2], columns[k + 3]};
  const Lanes4 factor[kPack] = {a[0], a[1], a[2], a[3]};
  for (int i = from; i < columns.length; i += kPack) {
    const Lanes4 some = factor[0] * math::load(x[0] + i) + factor[1] * math::load(x[1] + i);
    const Lanes4 more = factor[2] * math::load(x[2] + i) + factor[3] * math::load(x[3] + i);
    math::store(math::load(y + i) - (some + more), y + i);
  }
}

/// y = L^-1 y as far as the first `count` columns of L are known; its diagonal is 1.
inline void eliminate(const Columns& L, int count, double* y) {
  int k = 0;
  for (; k + kPack <= count; k += kPack) {
    const double* const x[kPack - 1] = {L[k] + k, L[k + 1] + k, L[k + 2] + k};
    double a[kPack];  // in registers: entries that are written one by one and read as a pack stall the processor
    a[0] = y[k];
    a[1] = y[k + 1] - a[0] * x[0][1];
    a[2] = y[k + 2] - a[0] * x[0][2] - a[1] * x[1][2];
    a[3] = y[k + 3] - a[0] * x[0][3] - a[1] * x[1][3] - a[2] * x[2][3];
    subtract_pack(a, L, k, y, k + kPack);
    for (int i = 1; i < kPack; ++i) y[k + i] = a[i];
  }
  for (; k < count; ++k) subtract(y[k], L[k], y, k + 1, L.length);
}

inline void divide_below(const Columns& columns, int j, double pivot) {
  double* y = columns[j];
  const double inverse = 1.0 / pivot;
  int i = j + 1;
  for (; i % kPack != 0; ++i) y[i] *= inverse;
  for (; i < columns.length; i += kPack) math::store(math::load(y + i) * Lanes4(inverse), y + i);
}

/// Column by column: each is made of the finished ones on its left.
LAYFIGURE_KERNEL
void solve_by_squares(const Columns& columns, double least_pivot, double* pivots) {
  for (int j = 0; j < columns.size; ++j) {
    double* y = columns[j];
    int k = 0;
    for (; k + kPack <= j; k += kPack) {
      double a[kPack];
      for (int i = 0; i < kPack; ++i) a[i] = pivots[k + i] * columns[k + i][j];
      subtract_pack(a, columns, k, y, j / kPack * kPack);
    }
    for (; k < j; ++k) subtract(pivots[k] * columns[k][j], columns[k], y, j, columns.length);
    pivots[j] = y[j] > least_pivot ? y[j] : least_pivot;
    divide_below(columns, j, pivots[j]);
  }
  double* x = columns[columns.size];
  eliminate(columns, columns.size, x);
  for (int k = columns.size - 1; k >= 0; --k) {
    double sum = x[k] / pivots[k];
    for (int i = k + 1; i < columns.size; ++i) sum -= columns[k][i] * x[i];
    x[k] = sum;
  }
}

/// The row of column j's pivot.
inline int pivot_row(const double* y, int j, const Columns& columns) {
  Lanes4 most(0.0);
  for (int i = j / kPack * kPack; i < columns.length; i += kPack) {
    const Lanes4 entries = math::load(y + i);
    most = math::maximum(most, math::maximum(entries, -entries));
  }
  if (math::all(most * Lanes4(kPivotShare) <= Lanes4(std::abs(y[j])))) return j;
  int largest = j;
  for (int i = j + 1; i < columns.size; ++i) {
    if (std::abs(y[i]) > std::abs(y[largest])) largest = i;
  }
  return largest;
}

LAYFIGURE_KERNEL
void solve_by_elimination(const Columns& columns, double least_pivot, int* swaps) {
  const int n = columns.size;
  for (int j = 0; j <= n; ++j) {
    double* y = columns[j];
    for (int k = 0; k < j; ++k) {
      if (swaps[k] != k) std::swap(y[k], y[swaps[k]]);
    }
    eliminate(columns, j, y);
    if (j == n) break;
    swaps[j] = pivot_row(y, j, columns);
    if (swaps[j] != j) {
      for (int k = 0; k <= j; ++k) std::swap(columns[k][j], columns[k][swaps[j]]);
    }
    if (!(std::abs(y[j]) > least_pivot)) y[j] = least_pivot;
    divide_below(columns, j, y[j]);
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
  pivots_.reserve(size);
  swaps_.reserve(size);
}

void System::resize(int size) {
  size_ = size;
  packs_ = packs_of(size);
  columns_.resize(static_cast<std::size_t>(size + 1) * packs_);
  pivots_.resize(size);
  swaps_.resize(size);
  for (int k = 0; k <= size; ++k) {
    for (int i = size; i < packs_ * kPack; ++i) column(k)[i] = 0.0;
  }
}

void System::solve_symmetric(double least_pivot) {
  solve_by_squares({column(0), size_, packs_ * kPack}, least_pivot, pivots_.data());
}

void System::solve_general(double least_pivot) {
  solve_by_elimination({column(0), size_, packs_ * kPack}, least_pivot, swaps_.data());
}

}  // namespace layfigure::dynamics::lcp
