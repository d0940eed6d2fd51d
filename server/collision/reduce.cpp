#include "reduce.h"

#include <algorithm>
#include <limits>
#include <span>

namespace layfigure::collision {
namespace {

using Eigen::Vector3d;
using Points = std::span<const LocalPoint>;

/// The point with the largest score.
template <class Score>
const LocalPoint& best_of(Points points, Score score) {
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

/// Adds those of one layer.
void reduce_layer(Points points, const Vector3d& normal, double hysteresis, const Manifold& last, Manifold& manifold) {
  const auto bonus = [&](const LocalPoint& point) {
    const auto end = last.points.begin() + last.count;
    const auto same = [&](const LocalPoint& other) { return other.feature == point.feature; };
    return std::any_of(last.points.begin(), end, same) ? hysteresis : 0.0;
  };
  const auto keep = [&](const LocalPoint& point) { manifold.points[manifold.count++] = point; };
  if (points.size() <= kLayerPoints) {
    for (const auto& point : points) keep(point);
    return;
  }
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

}  // namespace

void reduce(std::vector<LocalPoint>& points, const Vector3d& normal, double layer, double hysteresis,
            Manifold& manifold) {
  const Manifold last = manifold;
  manifold.count = 0;
  double deepest = std::numeric_limits<double>::infinity();
  for (const auto& point : points) deepest = std::min(deepest, point.gap);
  const auto above = std::partition(points.begin(), points.end(),
                                    [&](const LocalPoint& point) { return point.gap <= deepest + layer; });
  reduce_layer({points.begin(), above}, normal, hysteresis, last, manifold);
  reduce_layer({above, points.end()}, normal, hysteresis, last, manifold);
  std::sort(manifold.points.begin(), manifold.points.begin() + manifold.count,
            [](const LocalPoint& p, const LocalPoint& q) { return p.feature < q.feature; });
}

}  // namespace layfigure::collision
