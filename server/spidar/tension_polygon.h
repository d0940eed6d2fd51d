#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "orthonormal.h"

namespace layfigure::spidar {

struct Offset {
  double x, y;
  [[nodiscard]] double squared_norm() const { return x * x + y * y; }
};

/// The polygon of all z with low <= t + x z_x + y z_y <= high.
class TensionPolygon {
 public:
  TensionPolygon(const Eight& t, const Plane& plane, const Range& range, double tolerance)
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

}  // namespace layfigure::spidar
