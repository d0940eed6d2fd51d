#include "layfigure/spidar/tension_solver.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <optional>

#include "null_space.h"

namespace layfigure::spidar {
namespace {

using Eigen::Vector2d;
using WrenchMatrix = Eigen::Matrix<double, 6, kStrings>;
using Matrix8 = Eigen::Matrix<double, kStrings, kStrings>;

// Torques, as forces at the grip's radius, count for so much less than forces.
constexpr double kTorqueShare = 0.1;
// Weight of the tensions' own size beside that of the wrench: what it takes from a wrench is below 1e-7 of it.
constexpr double kRegularization = 1e-9;
// Of the largest tension: so far beyond its range a tension may be for rounding.
constexpr double kRangeRounding = 1e-12;
// Block pivots without progress until single ones take over.
constexpr int kPatience = 3;

/// The polygon of all z with low <= t0 + N z <= high.
struct Polygon {
  const Tensions& start;
  const NullSpace& N;
  double low;
  double high;

  [[nodiscard]] bool contains(const Vector2d& z, double tolerance) const {
    const Tensions t = start + N * z;
    return t.minCoeff() >= low - tolerance && t.maxCoeff() <= high + tolerance;
  }

  /// The nearest point to `z` on the edge where string i has the tension `at`; nothing if that line misses the polygon.
  [[nodiscard]] std::optional<Vector2d> nearest_on_edge(const Vector2d& z, int i, double at, double tolerance) const {
    const Vector2d n = N.row(i).transpose();
    const double n2 = n.squaredNorm();
    if (n2 == 0.0) return std::nullopt;
    const Vector2d foot = z + (at - start[i] - n.dot(z)) / n2 * n;
    const Vector2d along(-n.y(), n.x());
    double first = -INFINITY;
    double last = INFINITY;
    for (int j = 0; j < kStrings; ++j) {
      if (j == i) continue;
      const double base = start[j] + N.row(j).dot(foot);
      const double slope = N.row(j).dot(along);
      if (slope == 0.0) {
        if (base < low - tolerance || base > high + tolerance) return std::nullopt;
        continue;
      }
      const double a = (low - tolerance - base) / slope;
      const double b = (high + tolerance - base) / slope;
      first = std::max(first, std::min(a, b));
      last = std::min(last, std::max(a, b));
    }
    if (first > last) return std::nullopt;
    return foot + std::clamp(0.0, first, last) * along;
  }

  /// The point of the polygon that is nearest to `z`; nothing if it is empty.
  [[nodiscard]] std::optional<Vector2d> nearest(const Vector2d& z, double tolerance) const {
    if (contains(z, 0.0)) return z;
    std::optional<Vector2d> best;
    for (int i = 0; i < kStrings; ++i) {
      for (const double at : {low, high}) {
        const auto point = nearest_on_edge(z, i, at, tolerance);
        if (point && (!best || (*point - z).squaredNorm() < (*best - z).squaredNorm())) best = point;
      }
    }
    return best;
  }
};

/// min 1/2 t^T H t - c^T t in a box, H positive definite.
class BoxProblem {
 public:
  BoxProblem(const Matrix8& H, const Tensions& c, double low, double high) : H_(H), c_(c), low_(low), high_(high) {
    side_.fill(Side::kFree);
  }

  Tensions solve(int most_pivots, int& pivots) {
    int fewest = kStrings + 1;
    int patience = kPatience;
    for (pivots = 0; pivots < most_pivots; ++pivots) {
      update();
      const int wrong = count_wrong();
      if (wrong == 0) break;
      if (wrong < fewest) {
        fewest = wrong;
        patience = kPatience;
      }
      pivot(patience > 0);
      --patience;
    }
    return t_.cwiseMax(low_).cwiseMin(high_);
  }

 private:
  enum class Side { kLow, kFree, kHigh };

  /// Tensions that make the gradient zero on free strings, and the gradient.
  void update() {
    Matrix8 A = Matrix8::Identity();
    for (int i = 0; i < kStrings; ++i) {
      if (side_[i] != Side::kFree) t_[i] = side_[i] == Side::kLow ? low_ : high_;
    }
    Tensions b = c_;
    for (int i = 0; i < kStrings; ++i) {
      if (side_[i] != Side::kFree) {
        b[i] = t_[i];
        continue;
      }
      for (int j = 0; j < kStrings; ++j) {
        if (side_[j] == Side::kFree) {
          A(i, j) = H_(i, j);
        } else {
          b[i] -= H_(i, j) * t_[j];
        }
      }
    }
    t_ = A.llt().solve(b);
    gradient_ = H_ * t_ - c_;
  }

  [[nodiscard]] std::optional<Side> better_side(int i) const {
    if (side_[i] == Side::kFree) {
      if (t_[i] < low_) return Side::kLow;
      if (t_[i] > high_) return Side::kHigh;
      return std::nullopt;
    }
    const bool leaves = side_[i] == Side::kLow ? gradient_[i] < 0.0 : gradient_[i] > 0.0;
    return leaves ? std::optional(Side::kFree) : std::nullopt;
  }

  [[nodiscard]] int count_wrong() const {
    int wrong = 0;
    for (int i = 0; i < kStrings; ++i) wrong += better_side(i).has_value() ? 1 : 0;
    return wrong;
  }

  /// Moves all strings to their better sides, or the last one alone.
  void pivot(bool all) {
    for (int i = kStrings - 1; i >= 0; --i) {
      const auto better = better_side(i);
      if (!better) continue;
      side_[i] = *better;
      if (!all) return;
    }
  }

  const Matrix8& H_;
  const Tensions& c_;
  double low_;
  double high_;
  std::array<Side, kStrings> side_;
  Tensions t_{Tensions::Zero()};
  Tensions gradient_{Tensions::Zero()};
};

/// Those in the range that exert `wrench` and are nearest to `reference` each; nothing if there are none.
std::optional<Tensions> exact_tensions(const WrenchMatrix& W, const Wrench& wrench, const Geometry& geometry,
                                       double reference) {
  const Eigen::HouseholderQR<Eigen::Matrix<double, kStrings, 6>> qr(W.transpose());
  const Matrix8 Q = qr.householderQ();
  // W = R^T Q1^T: the shortest tensions are Q1 R^-T w.
  const Wrench y = qr.matrixQR().topRows<6>().triangularView<Eigen::Upper>().transpose().solve(wrench);
  const Tensions start = Q.leftCols<6>() * y;
  const NullSpace N = Q.rightCols<2>();
  const Polygon polygon{start, N, geometry.least_tension, geometry.most_tension};
  const Vector2d wanted = N.transpose() * Tensions::Constant(reference);
  const auto z = polygon.nearest(wanted, kRangeRounding * geometry.most_tension);
  if (!z) return std::nullopt;
  return start + N * *z;
}

Tensions nearest_tensions(const WrenchMatrix& W, const Wrench& wrench, const Geometry& geometry, double reference,
                          int& pivots) {
  WrenchMatrix weighted = W;
  weighted.bottomRows<3>() *= kTorqueShare;
  Wrench weighted_wrench = wrench;
  weighted_wrench.tail<3>() *= kTorqueShare;
  Matrix8 H = weighted.transpose() * weighted;
  H.diagonal().array() += kRegularization;
  const Tensions c = weighted.transpose() * weighted_wrench + Tensions::Constant(kRegularization * reference);
  return BoxProblem(H, c, geometry.least_tension, geometry.most_tension).solve(TensionSolver::kMostPivots, pivots);
}

}  // namespace

TensionSolver::TensionSolver(const Geometry& geometry, double reference)
    : geometry_(geometry), grip_radius_(geometry.grip_radius()), reference_(reference) {
  if (!(reference >= geometry.least_tension && reference <= geometry.most_tension)) {
    throw GeometryError("reference tension = " + std::to_string(reference) + " N, expected from " +
                        std::to_string(geometry.least_tension) + " to " + std::to_string(geometry.most_tension));
  }
}

TensionSolution TensionSolver::solve(const Pose& pose, const Wrench& wrench) const {
  TensionSolution solution{.tensions = Tensions::Constant(reference_), .wrench = Wrench::Zero()};
  const WrenchMatrix W = scaled_wrench_matrix(geometry_, pose);
  if (!wrench.allFinite() || !W.allFinite()) return solution;
  Wrench scaled = wrench;
  scaled.tail<3>() /= grip_radius_;
  const auto exact = exact_tensions(W, scaled, geometry_, reference_);
  solution.exact = exact.has_value();
  solution.tensions = exact ? *exact : nearest_tensions(W, scaled, geometry_, reference_, solution.pivots);
  solution.tensions = solution.tensions.cwiseMax(geometry_.least_tension).cwiseMin(geometry_.most_tension);
  solution.wrench = W * solution.tensions;
  solution.wrench.tail<3>() *= grip_radius_;
  return solution;
}

}  // namespace layfigure::spidar
