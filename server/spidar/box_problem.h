#pragma once

#include <algorithm>
#include <array>
#include <optional>

#include "cholesky.h"
#include "wrench_columns.h"

namespace layfigure::spidar {

// Torques, as forces at the grip's radius, count for so much less than forces.
inline constexpr double kTorqueShare = 0.1;
// Weight of the tensions' own size beside that of the wrench: what it takes from a wrench is below 1e-7 of it.
inline constexpr double kRegularization = 1e-9;
// Block pivots without progress until the active set takes over.
inline constexpr int kPatience = 1;
// A gradient of this size [N] is rounding: of tensions of tens of newtons in sums of eight.
inline constexpr double kRounding = 1e-12;

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

}  // namespace layfigure::spidar
