#pragma once

#include <array>

namespace layfigure::spidar {

/// Factors the leading n x n of a symmetric matrix, of which the lower triangle is given, in place: A = L D L^T, with L
/// below the diagonal and 1/D on it. False where it is not positive definite. No square roots: this is what a haptic
/// tick spends its time on.
template <int kSize>
inline bool factor(std::array<std::array<double, kSize>, kSize>& A, int n = kSize) {
  for (int k = 0; k < n; ++k) {
    if (!(A[k][k] > 0.0)) return false;
    A[k][k] = 1.0 / A[k][k];
    for (int i = k + 1; i < n; ++i) {
      const double l = A[i][k] * A[k][k];
      for (int j = k + 1; j < i; ++j) A[i][j] -= l * A[j][k];
      A[i][i] -= l * A[i][k];
    }
    for (int i = k + 1; i < n; ++i) A[i][k] *= A[k][k];
  }
  return true;
}

/// Solves A x = b with what factor() made, in place.
template <int kSize>
inline void solve(const std::array<std::array<double, kSize>, kSize>& LD, std::array<double, kSize>& x, int n = kSize) {
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) x[i] -= LD[i][j] * x[j];
  }
  for (int i = n - 1; i >= 0; --i) {
    x[i] *= LD[i][i];
    for (int j = i + 1; j < n; ++j) x[i] -= LD[j][i] * x[j];
  }
}

}  // namespace layfigure::spidar
