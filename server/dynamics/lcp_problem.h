#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>

#include "layfigure/dynamics/lcp.h"
#include "lcp_factor.h"

namespace layfigure::dynamics::lcp {

/// Rows [first, end) of a column of A', outside of which it is zero; whole contacts. Bodies that no joint ties together
/// have nothing in common: in a stack of boxes a contact reaches no further than to those of the boxes next to it.
struct Extent {
  int first;
  int end;
};
[[nodiscard]] inline Extent joint(const Extent& a, const Extent& b) {
  return {std::min(a.first, b.first), std::max(a.end, b.end)};
}

/// The problem in scaled rows: lambda' = lambda / (d m), v' = d v / m, A'_ij = d_i A_ij d_j, so that A' has about a
/// unit diagonal and the largest of b' and P_K(0) is 1. Names below are of the scaled quantities.
struct Problem {
  int size{0};
  Vector matrix;                ///< A', both triangles, column-major
  std::vector<Extent> extents;  ///< of each of its columns, the same for columns 3 k, 3 k + 1 and 3 k + 2
  Vector bias;                  ///< b'
  Vector scaling;               ///< d
  std::vector<LcpRow> rows;     ///< with the bounds scaled
  double magnitude{1.0};        ///< m

  [[nodiscard]] const double* column(int j) const { return matrix.data() + static_cast<std::size_t>(j) * size; }
};

/// Rows that a law at row i takes.
[[nodiscard]] inline int rows_of(const LcpRow& row) { return row.kind == LcpRowKind::kContact ? 3 : 1; }

void reserve(Problem& problem, int rows);

/// Fills `problem`; false if A or b are not finite or the rows are no laws.
[[nodiscard]] bool set_up(const Eigen::Ref<const Eigen::MatrixXd>& delassus,
                          const Eigen::Ref<const Eigen::VectorXd>& bias, std::span<const LcpRow> rows,
                          Problem& problem);

/// y += A x
void add_product(const Problem& problem, const Vector& x, Vector& y);

/// v = A lambda + b
void velocities(const Problem& problem, const Vector& lambda, Vector& v);

/// |t| of a tangential pair
[[nodiscard]] inline double length(const double* t) { return std::sqrt(t[0] * t[0] + t[1] * t[1]); }

/// The three cases of the projection of z onto a friction cone.
enum class ConeCase { kInside, kOutside, kPolar };
[[nodiscard]] inline ConeCase cone_case(double mu, double normal, double tangential) {
  if (tangential <= mu * normal) return ConeCase::kInside;
  return mu * tangential <= -normal ? ConeCase::kPolar : ConeCase::kOutside;
}

/// x = P_K(x) for the law at row i; x points at that row's entry.
void project_row(const LcpRow& row, double* x);

/// x = P_K(x)
void project(const Problem& problem, Vector& x);

/// x = projection of x onto K's recession cone: the directions in which K has no end.
void project_recession(const Problem& problem, Vector& x);

/// s = mu |v_t| on the normal row of each contact, 0 elsewhere.
void contact_offsets(const Problem& problem, const Vector& v, Vector& s);

/// z = the right side of equation (1) of lcp.h at z = lambda - v, for the law at row i; z points at that row's entry.
void apply_law(const LcpRow& row, double* z);

/// Largest component of equation (1)'s difference.
struct Residual {
  double value{0.0};
  int row{-1};
};
[[nodiscard]] Residual natural_residual(const Problem& problem, const Vector& lambda, const Vector& v);

}  // namespace layfigure::dynamics::lcp
