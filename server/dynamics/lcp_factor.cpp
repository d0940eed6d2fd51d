#include "lcp_factor.h"

#include <cmath>
#include <utility>

namespace layfigure::dynamics::lcp {
namespace {

/// y[from..to) -= a x[from..to)
inline void subtract(double a, const double* __restrict x, double* __restrict y, int from, int to) {
  for (int i = from; i < to; ++i) y[i] -= a * x[i];
}

}  // namespace

void System::reserve(int size) {
  matrix_.reserve(static_cast<std::size_t>(size) * size);
  rhs_.reserve(size);
}

void System::resize(int size) {
  size_ = size;
  matrix_.resize(static_cast<std::size_t>(size) * size);
  rhs_.resize(size);
}

void System::solve_symmetric(double least_pivot) {
  const int n = size_;
  double* x = rhs_.data();
  for (int k = 0; k < n; ++k) {
    double* pivot_column = column(k);
    if (!(pivot_column[k] > least_pivot)) pivot_column[k] = least_pivot;
    const double inverse = 1.0 / pivot_column[k];
    for (int j = k + 1; j < n; ++j) subtract(pivot_column[j] * inverse, pivot_column, column(j), j, n);
    for (int j = k + 1; j < n; ++j) pivot_column[j] *= inverse;
    subtract(x[k], pivot_column, x, k + 1, n);
  }
  for (int k = n - 1; k >= 0; --k) {
    const double* below = column(k);
    double sum = x[k] / below[k];
    for (int i = k + 1; i < n; ++i) sum -= below[i] * x[i];
    x[k] = sum;
  }
}

void System::swap_rows(int i, int k) {
  for (int j = 0; j < size_; ++j) std::swap(column(j)[i], column(j)[k]);
  std::swap(rhs_[i], rhs_[k]);
}

void System::eliminate_right_of(int k) {
  const double* multipliers = column(k);
  for (int j = k + 1; j < size_; ++j) subtract(column(j)[k], multipliers, column(j), k + 1, size_);
  subtract(rhs_[k], multipliers, rhs_.data(), k + 1, size_);
}

void System::solve_general(double least_pivot) {
  const int n = size_;
  for (int k = 0; k < n; ++k) {
    double* pivot_column = column(k);
    int largest = k;
    for (int i = k + 1; i < n; ++i) {
      if (std::abs(pivot_column[i]) > std::abs(pivot_column[largest])) largest = i;
    }
    if (largest != k) swap_rows(largest, k);
    if (!(std::abs(pivot_column[k]) > least_pivot)) pivot_column[k] = least_pivot;
    const double inverse = 1.0 / pivot_column[k];
    for (int i = k + 1; i < n; ++i) pivot_column[i] *= inverse;
    eliminate_right_of(k);
  }
  for (int k = n - 1; k >= 0; --k) {
    rhs_[k] /= column(k)[k];
    subtract(rhs_[k], column(k), rhs_.data(), 0, k);
  }
}

}  // namespace layfigure::dynamics::lcp
