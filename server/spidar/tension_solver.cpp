#include "layfigure/spidar/tension_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "cholesky.h"
#include "eight.h"
#include "layfigure/math/kernel.h"

namespace layfigure::spidar {
namespace {

using Six = std::array<double, 6>;
using SixColumns = std::array<Eight, 6>;
using StringNumbers = std::array<double, kStrings>;

// Torques, as forces at the grip's radius, count for so much less than forces.
constexpr double kTorqueShare = 0.1;
// Weight of the tensions' own size beside that of the wrench: what it takes from a wrench is below 1e-7 of it.
constexpr double kRegularization = 1e-9;
// Of the largest tension: so far beyond its range a tension may be for rounding.
constexpr double kRangeRounding = 1e-12;
// Block pivots without progress until the active set takes over.
constexpr int kPatience = 1;
// A gradient of this size [N] is rounding: of tensions of tens of newtons in sums of eight.
constexpr double kRounding = 1e-12;
// What is left of a column of W^T, of which most entries are near 1, when it depends on the others.
constexpr double kDependent = 1e-9;
// Least share of one string in the null space's projector, of trace 2 over eight strings, and in what one vector leaves
// of it: the largest is above.
constexpr double kLeastShare = 0.1;

StringNumbers numbers(const Eight& x) {
  StringNumbers result;
  store_eight(x, result.data());
  return result;
}

/// sum over k of columns[k] * factors[k]
Eight combined(const SixColumns& columns, const Six& factors) {
  Eight sum = columns[0] * factors[0];
  for (int k = 1; k < 6; ++k) sum = sum + columns[k] * factors[k];
  return sum;
}

/// The product of each column with x.
Six products(const SixColumns& columns, const Eight& x) {
  const math::Lanes4 first = totals(columns[0] * x, columns[1] * x, columns[2] * x, columns[3] * x);
  const math::Lanes4 last = totals(columns[4] * x, columns[5] * x, columns[4] * x, columns[5] * x);
  return {first.v[0], first.v[1], first.v[2], first.v[3], last.v[0], last.v[1]};
}

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
    while (string + 1 < kStrings && share[string] < kLeastShare) ++string;
    StringNumbers unit{};
    unit[string] = 1.0;
    Eight d = basis.without_wrench(load_eight(unit.data()));
    for (int pass = 0; pass < 2; ++pass) d = d - beside * total(beside * d);
    return d * (1.0 / std::sqrt(total(d * d)));
  }
};

struct Range {
  double low, high;
};

bool is_within(const Eight& t, const Range& range) { return least(t) >= range.low && most(t) <= range.high; }

struct Offset {
  double x, y;
  [[nodiscard]] double squared_norm() const { return x * x + y * y; }
};

/// The polygon of all z with low <= t + x z_x + y z_y <= high.
class Polygon {
 public:
  Polygon(const Eight& t, const Plane& plane, const Range& range, double tolerance)
      : t_(numbers(t)), x_(numbers(plane.x)), y_(numbers(plane.y)), range_(range), tolerance_(tolerance) {}

  /// Its point nearest to 0, which is beyond it; nothing if it is empty. It lies on an edge whose string is out of
  /// range at 0: the way to it is a sum of normals of the edges that it lies on, none of them negative.
  [[nodiscard]] std::optional<Offset> nearest() const {
    std::optional<Offset> best;
    for (int i = 0; i < kStrings; ++i) {
      if (t_[i] >= range_.low && t_[i] <= range_.high) continue;
      const auto point = nearest_on_edge(i, t_[i] < range_.low ? range_.low : range_.high);
      if (point && (!best || point->squared_norm() < best->squared_norm())) best = point;
    }
    return best;
  }

 private:
  /// On the edge where string i has the tension `at`; nothing if that line misses the polygon.
  [[nodiscard]] std::optional<Offset> nearest_on_edge(int i, double at) const {
    const double n2 = x_[i] * x_[i] + y_[i] * y_[i];
    if (n2 == 0.0) return std::nullopt;
    const Offset foot{(at - t_[i]) / n2 * x_[i], (at - t_[i]) / n2 * y_[i]};
    const Offset along{-y_[i], x_[i]};
    double first = -INFINITY;
    double last = INFINITY;
    for (int j = 0; j < kStrings; ++j) {
      if (j == i) continue;
      const double base = t_[j] + x_[j] * foot.x + y_[j] * foot.y;
      const double slope = x_[j] * along.x + y_[j] * along.y;
      const double below = range_.low - tolerance_ - base;
      const double above = range_.high + tolerance_ - base;
      if (slope == 0.0) {
        if (below > 0.0 || above < 0.0) return std::nullopt;
        continue;
      }
      const double inverse = 1.0 / slope;
      first = std::max(first, std::min(below * inverse, above * inverse));
      last = std::min(last, std::max(below * inverse, above * inverse));
    }
    if (first > last) return std::nullopt;
    const double s = std::clamp(0.0, first, last);
    return Offset{foot.x + s * along.x, foot.y + s * along.y};
  }

  StringNumbers t_, x_, y_;
  Range range_;
  double tolerance_;
};

/// min 1/2 t^T H t - c^T t in a box, H positive definite.
class BoxProblem {
 public:
  BoxProblem(const SixColumns& columns, const Six& wrench, double reference, const Range& range) : range_(range) {
    Eight c = all_eight(kRegularization * reference);
    std::array<StringNumbers, 6> weighted;
    for (int k = 0; k < 6; ++k) {
      const double share = k < 3 ? 1.0 : kTorqueShare * kTorqueShare;
      c = c + columns[k] * (share * wrench[k]);
      weighted[k] = numbers(columns[k] * share);
    }
    for (int i = 0; i < kStrings; ++i) {
      Six row;
      for (int k = 0; k < 6; ++k) row[k] = weighted[k][i];
      H_[i] = numbers(combined(columns, row));
      H_[i][i] += kRegularization;
    }
    c_ = numbers(c);
  }

  /// From those strings at their bounds that are there or beyond in `guess`.
  Eight solve(const Eight& guess, int most_pivots, int& pivots) {
    start_from(numbers(guess));
    int fewest = kStrings + 1;
    int patience = kPatience;
    for (pivots = 0; patience > 0; ++pivots) {
      update();
      const int wrong = count_wrong();
      if (wrong == 0) return load_eight(t_.data());
      patience = wrong < fewest ? kPatience : patience - 1;
      fewest = std::min(fewest, wrong);
      move_all_to_better_sides();
    }
    descend(most_pivots, pivots);
    return load_eight(t_.data());
  }

 private:
  enum class Side { kLow, kFree, kHigh };

  void start_from(const StringNumbers& guess) {
    for (int i = 0; i < kStrings; ++i) {
      side_[i] = guess[i] <= range_.low ? Side::kLow : guess[i] >= range_.high ? Side::kHigh : Side::kFree;
    }
  }

  /// From tensions in the range on: to the least on the free strings, or as far as the first of them comes to its
  /// bound, which it is then kept at; from a least, that string is let go which most wants to leave its bound. The
  /// objective falls with every string that is let go, so no set of bounds comes back.
  void descend(int most_pivots, int& pivots) {
    StringNumbers at;
    for (int i = 0; i < kStrings; ++i) {
      at[i] = std::clamp(t_[i], range_.low, range_.high);
      if (side_[i] == Side::kFree && at[i] != t_[i]) side_[i] = t_[i] < at[i] ? Side::kLow : Side::kHigh;
      if (side_[i] != Side::kFree) at[i] = side_[i] == Side::kLow ? range_.low : range_.high;
    }
    for (; pivots < most_pivots; ++pivots) {
      update();
      const int stop = go_towards_least(at);
      if (stop < 0 && !let_go_of_one()) break;
    }
    t_ = at;
  }

  /// The string whose bound was met, -1 if none.
  int go_towards_least(StringNumbers& at) {
    double share = 1.0;
    int stop = -1;
    for (int i = 0; i < kStrings; ++i) {
      if (side_[i] != Side::kFree || (t_[i] >= range_.low && t_[i] <= range_.high)) continue;
      const double bound = t_[i] < range_.low ? range_.low : range_.high;
      const double to_bound = (bound - at[i]) / (t_[i] - at[i]);
      if (to_bound >= share && stop >= 0) continue;
      share = std::min(to_bound, 1.0);
      stop = i;
    }
    for (int i = 0; i < kStrings; ++i) at[i] += share * (t_[i] - at[i]);
    if (stop < 0) return stop;
    side_[stop] = t_[stop] < range_.low ? Side::kLow : Side::kHigh;
    at[stop] = side_[stop] == Side::kLow ? range_.low : range_.high;
    return stop;
  }

  bool let_go_of_one() {
    int strongest = -1;
    double pull = kRounding;
    for (int i = 0; i < kStrings; ++i) {
      if (side_[i] == Side::kFree) continue;
      const double outward = side_[i] == Side::kLow ? -gradient_[i] : gradient_[i];
      if (outward <= pull) continue;
      pull = outward;
      strongest = i;
    }
    if (strongest < 0) return false;
    side_[strongest] = Side::kFree;
    return true;
  }

  /// Tensions that make the gradient zero on free strings, and the gradient.
  void update() {
    StringNumbers gradient;
    for (int i = 0; i < kStrings; ++i) gradient[i] = -c_[i];
    std::array<int, kStrings> free;
    int count = 0;
    for (int i = 0; i < kStrings; ++i) {
      if (side_[i] == Side::kFree) {
        free[count++] = i;
        continue;
      }
      t_[i] = side_[i] == Side::kLow ? range_.low : range_.high;
      for (int j = 0; j < kStrings; ++j) gradient[j] += H_[i][j] * t_[i];
    }
    std::array<StringNumbers, kStrings> A;
    StringNumbers b;
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j <= i; ++j) A[i][j] = H_[free[i]][free[j]];
      b[i] = -gradient[free[i]];
    }
    (void)factor<kStrings>(A, count);
    spidar::solve<kStrings>(A, b, count);
    for (int i = 0; i < count; ++i) {
      t_[free[i]] = b[i];
      for (int j = 0; j < kStrings; ++j) gradient[j] += H_[free[i]][j] * b[i];
    }
    gradient_ = gradient;
  }

  [[nodiscard]] std::optional<Side> better_side(int i) const {
    if (side_[i] == Side::kFree) {
      if (t_[i] < range_.low) return Side::kLow;
      if (t_[i] > range_.high) return Side::kHigh;
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

  void move_all_to_better_sides() {
    for (int i = 0; i < kStrings; ++i) {
      if (const auto better = better_side(i)) side_[i] = *better;
    }
  }

  std::array<StringNumbers, kStrings> H_;
  StringNumbers c_;
  Range range_;
  std::array<Side, kStrings> side_{};
  StringNumbers t_{};
  StringNumbers gradient_{};
};

}  // namespace

TensionSolver::TensionSolver(const Geometry& geometry, double reference)
    : strings_(std::make_unique<Strings>(geometry)),
      least_(geometry.least_tension),
      most_(geometry.most_tension),
      reference_(reference) {
  if (!(reference >= geometry.least_tension && reference <= geometry.most_tension)) {
    throw GeometryError("reference tension = " + std::to_string(reference) + " N, expected from " +
                        std::to_string(geometry.least_tension) + " to " + std::to_string(geometry.most_tension));
  }
}

TensionSolver::~TensionSolver() = default;

TensionSolution TensionSolver::solve(const Pose& pose, const Wrench& wrench) const {
  TensionSolution none;
  none.exact = true;
  return solve(pose, wrench, none);
}

LAYFIGURE_KERNEL
TensionSolution TensionSolver::solve(const Pose& pose, const Wrench& wrench, const TensionSolution& last) const {
  TensionSolution solution{.tensions = Tensions::Constant(reference_), .wrench = Wrench::Zero()};
  const SixColumns columns = straight_strings(*strings_, pose).wrenches;
  if (!wrench.allFinite() || !pose.position.allFinite() || !pose.rotation.coeffs().allFinite()) return solution;
  Six wanted;
  for (int k = 0; k < 6; ++k) wanted[k] = k < 3 ? wrench[k] : wrench[k] / strings_->grip_radius;

  // The tensions nearest to the reference on every string that exert the wrench, whatever their range.
  const Orthonormal basis(columns);
  const Range range{least_, most_};
  Eight t = basis.shortest(wanted) + basis.without_wrench(all_eight(reference_));
  solution.exact = basis.full_rank && is_within(t, range);
  if (basis.full_rank && !solution.exact) {
    const Plane plane(basis);
    if (const auto z = Polygon(t, plane, range, kRangeRounding * most_).nearest()) {
      t = t + plane.x * z->x + plane.y * z->y;
      solution.exact = true;
    }
  }
  if (!solution.exact) {
    const Eight guess = last.exact ? t : load_eight(last.tensions);
    t = BoxProblem(columns, wanted, reference_, range).solve(guess, kMostPivots, solution.pivots);
  }

  store_eight(t, solution.tensions.data());
  solution.tensions = solution.tensions.cwiseMax(least_).cwiseMin(most_);
  const Six exerted = products(columns, load_eight(solution.tensions));
  for (int k = 0; k < 6; ++k) solution.wrench[k] = k < 3 ? exerted[k] : exerted[k] * strings_->grip_radius;
  return solution;
}

}  // namespace layfigure::spidar
