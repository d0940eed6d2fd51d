#include "lcp_system.h"

#include <algorithm>

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

}  // namespace

void ReducedSystem::reserve(int rows) {
  directions_.reserve(rows);
  change_.reserve(rows);
  product_.reserve(rows);
  system_.reserve(rows);
}

void ReducedSystem::clear(int rows) {
  directions_.clear();
  change_.assign(rows, 0.0);
  jumps_ = false;
  symmetric_ = true;
}

void ReducedSystem::add_free_row(int row, double compliance, double rhs) {
  directions_.push_back({.row = row, .count = 1, .u = {1.0}, .w = {1.0}, .compliance = compliance, .rhs = rhs});
}

void ReducedSystem::add(const Direction& direction) {
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

void ReducedSystem::fill_column(const Problem& problem, int k) {
  const Direction& d = directions_[k];
  const double* image = problem.column(d.row);  // A U
  if (d.count == 3) {
    const double* next = problem.column(d.row + 1);
    const double* last = problem.column(d.row + 2);
    for (int i = 0; i < problem.size; ++i) product_[i] = d.u[0] * image[i] + d.u[1] * next[i] + d.u[2] * last[i];
    image = product_.data();
  }
  double* column = system_.column(k);
  const int count = static_cast<int>(directions_.size());
  for (int i = symmetric_ ? k : 0; i < count; ++i) column[i] = along(directions_[i], image);
  column[k] += d.compliance;
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
