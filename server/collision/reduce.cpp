#include "reduce.h"

#include <algorithm>

namespace layfigure::collision {
namespace {

using Eigen::Vector3d;
using Points = std::vector<LocalPoint>;

/// The point with the largest score.
template <class Score>
const LocalPoint& best_of(const Points& points, Score score) {
  const LocalPoint* best = &points.front();
  double most = score(*best);
  for (const auto& point : points) {
    const double value = score(point);
    if (value > most) {
      most = value;
      best = &point;
    }
  }
  return *best;
}

}  // namespace

void reduce(const Points& points, const Vector3d& normal, double hysteresis, Manifold& manifold) {
  const Manifold last = manifold;
  const auto bonus = [&](const LocalPoint& point) {
    const auto end = last.points.begin() + last.count;
    const auto same = [&](const LocalPoint& other) { return other.feature == point.feature; };
    return std::any_of(last.points.begin(), end, same) ? hysteresis : 0.0;
  };
  manifold.count = 0;
  const auto keep = [&](const LocalPoint& point) { manifold.points[manifold.count++] = point; };
  if (points.size() <= kMaxPoints) {
    for (const auto& point : points) keep(point);
  } else {
    const LocalPoint& first = best_of(points, [&](const LocalPoint& p) { return bonus(p) - p.gap; });
    const LocalPoint& second =
        best_of(points, [&](const LocalPoint& p) { return bonus(p) + (p.on_a - first.on_a).norm(); });
    keep(first);
    keep(second);
    const Vector3d across = normal.cross(second.on_a - first.on_a).normalized();
    for (const double side : {1.0, -1.0}) {
      const auto distance = [&](const LocalPoint& p) { return side * across.dot(p.on_a - first.on_a); };
      const LocalPoint& far = best_of(points, [&](const LocalPoint& p) { return bonus(p) + distance(p); });
      if (distance(far) > hysteresis) keep(far);
    }
  }
  std::sort(manifold.points.begin(), manifold.points.begin() + manifold.count,
            [](const LocalPoint& p, const LocalPoint& q) { return p.feature < q.feature; });
}

}  // namespace layfigure::collision
