#include "lcp_problem.h"

#include <algorithm>

#include "layfigure/math/kernel.h"

namespace layfigure::dynamics::lcp {
namespace {

// A diagonal this far below the largest is rounding: its row is taken as one that nothing moves.
constexpr double kVanishingDiagonal = 1e-16;

bool is_law(std::span<const LcpRow> rows, std::size_t i) {
  const LcpRow& row = rows[i];
  if (row.kind == LcpRowKind::kBox) {
    return row.lower <= row.upper && row.lower < LcpRow::kInfinity && row.upper > -LcpRow::kInfinity;
  }
  return row.kind == LcpRowKind::kContact && std::isfinite(row.friction) && row.friction >= 0.0 &&
         i + 2 < rows.size() && rows[i + 1].kind == LcpRowKind::kTangent && rows[i + 2].kind == LcpRowKind::kTangent;
}

bool are_laws(std::span<const LcpRow> rows) {
  for (std::size_t i = 0; i < rows.size(); i += rows_of(rows[i])) {
    if (!is_law(rows, i)) return false;
  }
  return true;
}

bool is_finite(const Eigen::Ref<const Eigen::MatrixXd>& delassus, const Eigen::Ref<const Eigen::VectorXd>& bias) {
  // A difference x - x is 0 for finite numbers only; sums of them stay 0.
  double sum = (bias - bias).sum();
  for (Eigen::Index j = 0; j < delassus.cols(); ++j) {
    const auto lower = delassus.col(j).tail(delassus.rows() - j);
    sum += (lower - lower).sum();
  }
  return sum == 0.0;
}

void set_scaling(const Eigen::Ref<const Eigen::MatrixXd>& delassus, Problem& problem) {
  double largest = delassus.diagonal().maxCoeff();
  if (!(largest > 0.0)) largest = 1.0;
  for (int i = 0; i < problem.size;) {
    const int count = rows_of(problem.rows[i]);
    double diagonal = delassus.diagonal().segment(i, count).mean();
    if (!(diagonal > kVanishingDiagonal * largest)) diagonal = largest;
    std::fill_n(problem.scaling.begin() + i, count, 1.0 / std::sqrt(diagonal));
    i += count;
  }
}

/// One past the last row that the law at row j reaches.
int end_of_reach(const Eigen::Ref<const Eigen::MatrixXd>& delassus, const std::vector<LcpRow>& rows, int j) {
  const int n = static_cast<int>(rows.size());
  const int own_end = j + rows_of(rows[j]);
  int end = own_end;
  for (int k = j; k < own_end; ++k) {
    int last = n;
    while (last > end && delassus(last - 1, k) == 0.0) --last;
    end = last;
  }
  while (end < n && rows[end].kind == LcpRowKind::kTangent) ++end;
  return end;
}

void set_extents(const Eigen::Ref<const Eigen::MatrixXd>& delassus, Problem& problem) {
  const int n = problem.size;
  problem.extents.assign(n, {n, 0});
  for (int j = 0; j < n;) {
    const int own_end = j + rows_of(problem.rows[j]);
    const int end = end_of_reach(delassus, problem.rows, j);
    for (int i = j; i < end; ++i) problem.extents[i].first = std::min(problem.extents[i].first, j);
    for (; j < own_end; ++j) problem.extents[j].end = end;
  }
  for (int j = 0; j + 3 <= n; j += 3) {
    const Extent all = joint(joint(problem.extents[j], problem.extents[j + 1]), problem.extents[j + 2]);
    std::fill_n(problem.extents.begin() + j, 3, all);
  }
}

void scale_matrix(const Eigen::Ref<const Eigen::MatrixXd>& delassus, Problem& problem) {
  const int n = problem.size;
  const auto is_full = [n](const Extent& extent) { return extent.first == 0 && extent.end == n; };
  if (!std::all_of(problem.extents.begin(), problem.extents.end(), is_full)) {
    std::fill(problem.matrix.begin(), problem.matrix.end(), 0.0);
  }
  for (int j = 0; j < n; ++j) {
    const double d = problem.scaling[j];
    const int end = problem.extents[j].end;
    double* column = problem.matrix.data() + static_cast<std::size_t>(j) * n;
    for (int i = j; i < end; ++i) column[i] = problem.scaling[i] * delassus(i, j) * d;
    for (int i = j + 1; i < end; ++i) problem.matrix[static_cast<std::size_t>(i) * n + j] = column[i];
  }
}

/// y += A x, contact by contact: three columns at once. Those that x leaves out cost nothing.
LAYFIGURE_KERNEL
void add_columns(const double* matrix, const Extent* extents, int n, const double* __restrict x, double* __restrict y) {
  int j = 0;
  for (; j + 3 <= n; j += 3) {
    const double a0 = x[j], a1 = x[j + 1], a2 = x[j + 2];
    if (a0 == 0.0 && a1 == 0.0 && a2 == 0.0) continue;
    const double* __restrict c0 = matrix + static_cast<std::size_t>(j) * n;
    const double* __restrict c1 = c0 + n;
    const double* __restrict c2 = c1 + n;
    const auto [first, end] = extents[j];
    for (int i = first; i < end; ++i) y[i] += a0 * c0[i] + a1 * c1[i] + a2 * c2[i];
  }
  for (; j < n; ++j) {
    const double a = x[j];
    const double* __restrict c = matrix + static_cast<std::size_t>(j) * n;
    for (int i = extents[j].first; i < extents[j].end; ++i) y[i] += a * c[i];
  }
}

double magnitude_of(const Problem& problem) {
  double largest = 0.0;
  for (int i = 0; i < problem.size; ++i) {
    const LcpRow& row = problem.rows[i];
    largest = std::max(largest, std::abs(problem.bias[i]));
    if (row.kind == LcpRowKind::kBox) largest = std::max(largest, std::abs(std::clamp(0.0, row.lower, row.upper)));
  }
  return largest > 0.0 ? largest : 1.0;
}

void scale_vectors(const Eigen::Ref<const Eigen::VectorXd>& bias, Problem& problem) {
  for (int i = 0; i < problem.size; ++i) {
    problem.bias[i] = problem.scaling[i] * bias[i];
    problem.rows[i].lower /= problem.scaling[i];
    problem.rows[i].upper /= problem.scaling[i];
  }
  problem.magnitude = magnitude_of(problem);
  for (int i = 0; i < problem.size; ++i) {
    problem.bias[i] /= problem.magnitude;
    problem.rows[i].lower /= problem.magnitude;
    problem.rows[i].upper /= problem.magnitude;
  }
}

}  // namespace

void reserve(Problem& problem, int rows) {
  problem.matrix.reserve(static_cast<std::size_t>(rows) * rows);
  problem.extents.reserve(rows);
  problem.bias.reserve(rows);
  problem.scaling.reserve(rows);
  problem.rows.reserve(rows);
}

bool set_up(const Eigen::Ref<const Eigen::MatrixXd>& delassus, const Eigen::Ref<const Eigen::VectorXd>& bias,
            std::span<const LcpRow> rows, Problem& problem) {
  if (!are_laws(rows) || !is_finite(delassus, bias)) return false;
  const int n = static_cast<int>(rows.size());
  problem.size = n;
  problem.bias.resize(n);
  problem.scaling.resize(n);
  problem.rows.assign(rows.begin(), rows.end());
  problem.matrix.resize(static_cast<std::size_t>(n) * n);
  set_scaling(delassus, problem);
  set_extents(delassus, problem);
  scale_matrix(delassus, problem);
  scale_vectors(bias, problem);
  return std::isfinite(problem.magnitude);
}

void add_product(const Problem& problem, const Vector& x, Vector& y) {
  add_columns(problem.matrix.data(), problem.extents.data(), problem.size, x.data(), y.data());
}

void velocities(const Problem& problem, const Vector& lambda, Vector& v) {
  std::copy(problem.bias.begin(), problem.bias.end(), v.begin());
  add_product(problem, lambda, v);
}

void project_row(const LcpRow& row, double* x) {
  if (row.kind == LcpRowKind::kBox) {
    x[0] = std::clamp(x[0], row.lower, row.upper);
    return;
  }
  const double mu = row.friction;
  const double tangential = length(x + 1);
  const ConeCase where = cone_case(mu, x[0], tangential);
  if (where == ConeCase::kInside) return;
  const double normal = where == ConeCase::kPolar ? 0.0 : (x[0] + mu * tangential) / (1.0 + mu * mu);
  const double share = where == ConeCase::kPolar ? 0.0 : mu * normal / tangential;
  x[0] = normal;
  x[1] *= share;
  x[2] *= share;
}

void project(const Problem& problem, Vector& x) {
  for (int i = 0; i < problem.size; i += rows_of(problem.rows[i])) project_row(problem.rows[i], &x[i]);
}

void project_recession(const Problem& problem, Vector& x) {
  for (int i = 0; i < problem.size; i += rows_of(problem.rows[i])) {
    LcpRow row = problem.rows[i];
    if (std::isfinite(row.lower)) row.lower = 0.0;
    if (std::isfinite(row.upper)) row.upper = 0.0;
    project_row(row, &x[i]);
  }
}

void contact_offsets(const Problem& problem, const Vector& v, Vector& s) {
  std::fill(s.begin(), s.end(), 0.0);
  for (int i = 0; i < problem.size; i += rows_of(problem.rows[i])) {
    const LcpRow& row = problem.rows[i];
    if (row.kind == LcpRowKind::kContact) s[i] = row.friction * length(&v[i + 1]);
  }
}

void apply_law(const LcpRow& row, double* z) {
  if (row.kind == LcpRowKind::kBox) {
    z[0] = std::clamp(z[0], row.lower, row.upper);
    return;
  }
  z[0] = std::max(z[0], 0.0);
  const double trial = length(z + 1);
  const double edge = row.friction * z[0];
  if (trial <= edge) return;
  z[1] *= edge / trial;
  z[2] *= edge / trial;
}

Residual natural_residual(const Problem& problem, const Vector& lambda, const Vector& v) {
  Residual worst{-1.0, -1};
  for (int i = 0; i < problem.size;) {
    const int count = rows_of(problem.rows[i]);
    double target[3];
    for (int k = 0; k < count; ++k) target[k] = lambda[i + k] - v[i + k];
    apply_law(problem.rows[i], target);
    for (int k = 0; k < count; ++k) {
      const double error = std::abs(lambda[i + k] - target[k]);
      // A NaN is the worst of all.
      if (!(error <= worst.value)) worst = {error, i + k};
    }
    i += count;
  }
  return {std::max(worst.value, 0.0), worst.row};
}

}  // namespace layfigure::dynamics::lcp
