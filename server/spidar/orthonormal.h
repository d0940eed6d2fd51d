#pragma once

#include <cmath>

#include "wrench_columns.h"

namespace layfigure::spidar {

// What is left of a column of W^T, of which most entries are near 1, when it depends on the others.
inline constexpr double kDependent = 1e-9;
// Least share of one string in the null space's projector, of trace 2 over eight strings, and in what one vector leaves
// of it: the largest is above.
inline constexpr double kLeastUnitShare = 0.1;

/// W^T = Q R with orthonormal columns, by modified Gram-Schmidt: of W, whose condition is some tens in the workspace,
/// it loses no more than that of the digits.
struct Orthonormal {
  SixColumns Q;
  std::array<Six, 6> R;  ///< 1/R_kk on the diagonal
  bool full_rank{true};

  explicit Orthonormal(const SixColumns& columns) : Q(columns) {
    for (int k = 0; k < 6; ++k) {
      const double norm = std::sqrt(total(Q[k] * Q[k]));
      full_rank = full_rank && norm > kDependent;
      R[k][k] = 1.0 / norm;
      Q[k] = Q[k] * R[k][k];
      for (int j = k + 1; j < 6; ++j) {
        R[k][j] = total(Q[k] * Q[j]);
        Q[j] = Q[j] - Q[k] * R[k][j];
      }
    }
  }

  /// The shortest t with W t = w: W = R^T Q^T, so t = Q R^-T w.
  [[nodiscard]] Eight shortest(const Six& w) const {
    Six y = w;
    for (int k = 0; k < 6; ++k) {
      y[k] *= R[k][k];
      for (int j = k + 1; j < 6; ++j) y[j] -= R[k][j] * y[k];
    }
    return combined(Q, y);
  }

  /// The part of t without a wrench. Twice, so that it is orthogonal to rounding whatever is left.
  [[nodiscard]] Eight without_wrench(Eight t) const {
    t = t - combined(Q, products(Q, t));
    return t - combined(Q, products(Q, t));
  }
};

/// Two orthonormal vectors of tensions without a wrench: the parts of two strings' unit tensions, of the first strings
/// of which enough is left.
struct Plane {
  Eight x, y;

  explicit Plane(const Orthonormal& basis) {
    Eight shares = all_eight(1.0);
    for (const Eight& q : basis.Q) shares = shares - q * q;
    x = direction(basis, shares, all_eight(0.0));
    y = direction(basis, shares - x * x, x);
  }

 private:
  static Eight direction(const Orthonormal& basis, const Eight& shares, const Eight& beside) {
    const StringNumbers share = numbers(shares);
    int string = 0;
    while (string + 1 < kStrings && share[string] < kLeastUnitShare) ++string;
    StringNumbers unit{};
    unit[string] = 1.0;
    Eight d = basis.without_wrench(load_eight(unit.data()));
    for (int pass = 0; pass < 2; ++pass) d = d - beside * total(beside * d);
    return d * (1.0 / std::sqrt(total(d * d)));
  }
};

}  // namespace layfigure::spidar
