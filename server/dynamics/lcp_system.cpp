#include "lcp_system.h"

#include <algorithm>

#include "layfigure/math/kernel.h"

namespace layfigure::dynamics::lcp {
namespace {

// Far below any pivot that a regularised system has (lcp_newton.cpp).
constexpr double kLeastPivot = 1e-13;

/// W^T entries
inline double along(const Direction& d, const double* entries) {
  if (d.count == 1) return entries[d.row];
  const double* x = entries + d.row;
  return d.w[0] * x[0] + d.w[1] * x[1] + d.w[2] * x[2];
}

/// Three columns of length n from `first` on, combined.
LAYFIGURE_KERNEL
void combine(const double* __restrict first, int n, const Extent& rows, const double* u, double* __restrict sum) {
  const double u0 = u[0], u1 = u[1], u2 = u[2];
  const double* __restrict next = first + n;
  const double* __restrict last = next + n;
  for (int i = rows.first; i < rows.end; ++i) sum[i] = u0 * first[i] + u1 * next[i] + u2 * last[i];
}

}  // namespace

void ReducedSystem::reserve(int rows) {
  directions_.reserve(rows);
  rows_.reserve(rows);
  combined_.reserve(rows);
  change_.reserve(rows);
  product_.reserve(rows);
  system_.reserve(rows);
}

void ReducedSystem::clear(int rows) {
  reserve(rows);
  directions_.clear();
  rows_.clear();
  combined_.clear();
  change_.assign(rows, 0.0);
  jumps_ = false;
  symmetric_ = true;
}

void ReducedSystem::add_free_row(int row, double compliance, double rhs) {
  rows_.push_back(row);
  directions_.push_back({.row = row, .count = 1, .u = {1.0}, .w = {1.0}, .compliance = compliance, .rhs = rhs});
}

void ReducedSystem::add(const Direction& direction) {
  const bool takes_first = direction.w[0] == 1.0 && direction.w[1] == 0.0 && direction.w[2] == 0.0;
  if (!takes_first) combined_.push_back(static_cast<int>(directions_.size()));
  rows_.push_back(direction.row);
  directions_.push_back(direction);
  symmetric_ = symmetric_ && std::equal(direction.u, direction.u + 3, direction.w);
}

void ReducedSystem::jump(int row, double change) {
  change_[row] += change;
  jumps_ = jumps_ || change != 0.0;
}

void ReducedSystem::subtract_jump(const Problem& problem) {
  product_.assign(problem.size, 0.0);
  add_product(problem, change_, product_);
  for (Direction& d : directions_) d.rhs -= along(d, product_.data());
}

/// Directions whose rows are among these.
Extent ReducedSystem::directions_in(const Extent& rows) const {
  const auto place = [this](int row) {
    return static_cast<int>(std::lower_bound(rows_.begin(), rows_.end(), row) - rows_.begin());
  };
  const int count = static_cast<int>(rows_.size());
  return {rows.first == 0 ? 0 : place(rows.first), rows.end > rows_.back() ? count : place(rows.end)};
}

void ReducedSystem::fill_column(const Problem& problem, int k) {
  const Direction& d = directions_[k];
  Extent reach = problem.extents[d.row];
  const double* image = problem.column(d.row);  // A U
  if (d.count == 3) {
    reach = joint(joint(reach, problem.extents[d.row + 1]), problem.extents[d.row + 2]);
    combine(image, problem.size, reach, d.u, product_.data());
    image = product_.data();
  }
  const auto [start, end] = directions_in(reach);
  const int first = symmetric_ ? k : start;
  double* const column = system_.column(k);
  if (!symmetric_) system_.begin_column(k, first);
  const int* const rows = rows_.data();
#pragma GCC unroll 4
  for (int i = first; i < end; ++i) column[i] = image[rows[i]];
  for (const int i : combined_) {
    if (i >= first && i < end) column[i] = along(directions_[i], image);
  }
  column[k] += d.compliance;
  system_.end_column(k, end);
  system_.rhs()[k] = d.rhs;
}

void ReducedSystem::solve(const Problem& problem) {
  if (jumps_) subtract_jump(problem);
  const int count = static_cast<int>(directions_.size());
  system_.resize(count);
  product_.resize(problem.size);
  for (int k = 0; k < count; ++k) fill_column(problem, k);
  if (symmetric_) {
    system_.solve_symmetric(kLeastPivot);
  } else {
    system_.solve_general(kLeastPivot);
  }
  for (int k = 0; k < count; ++k) {
    const Direction& d = directions_[k];
    for (int i = 0; i < d.count; ++i) change_[d.row + i] += d.u[i] * system_.rhs()[k];
  }
}

}  // namespace layfigure::dynamics::lcp
