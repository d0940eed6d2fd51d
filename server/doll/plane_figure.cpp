#include "plane_figure.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace layfigure::doll {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

/// Signed integrals about a point near the figure, so that no digits are lost far from the origin.
struct Integrals {
  double twice_area{0.0};
  Vector2d first{Vector2d::Zero()};
  Matrix2d second{Matrix2d::Zero()};

  void add(const Vector2d& a, const Vector2d& b) {
    const double d = a.x() * b.y() - b.x() * a.y();
    const Vector2d s = a + b;
    twice_area += d;
    first += d / 6.0 * s;
    second += d / 24.0 * (a * a.transpose() + b * b.transpose() + s * s.transpose());
  }

  void add(const Polygon& polygon, const Vector2d& reference) {
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      add(polygon[k] - reference, polygon[(k + 1) % polygon.size()] - reference);
    }
  }
};

}  // namespace

double PlaneFigure::outermost() const {
  double largest = 0.0;
  for (const Vector2d& p : outline) largest = std::max(largest, (p - centroid).norm());
  return largest;
}

double PlaneFigure::outermost(const Vector2d& direction) const {
  double largest = 0.0;
  for (const Vector2d& p : outline) largest = std::max(largest, std::abs(direction.dot(p - centroid)));
  return largest;
}

PlaneFigure plane_figure(const std::vector<Polygon>& polygons) {
  if (polygons.empty() || polygons.front().size() < 3) return {};
  const Vector2d reference = polygons.front().front();
  Integrals sum;
  sum.add(polygons.front(), reference);
  const double sign = sum.twice_area > 0.0 ? 1.0 : -1.0;
  for (std::size_t k = 1; k < polygons.size(); ++k) sum.add(polygons[k], reference);
  if (!(sign * sum.twice_area > 0.0)) return {};

  PlaneFigure figure;
  const Vector2d centroid = sum.first / (0.5 * sum.twice_area);
  figure.area = 0.5 * sign * sum.twice_area;
  figure.centroid = reference + centroid;
  figure.second_moment = sign * sum.second - figure.area * centroid * centroid.transpose();
  const bool positive = figure.second_moment.trace() > 0.0 && figure.second_moment.determinant() > 0.0;
  if (!positive) return {};
  figure.outline = polygons.front();
  return figure;
}

double twice_signed_area(const Polygon& polygon) {
  if (polygon.empty()) return 0.0;
  Integrals sum;
  sum.add(polygon, polygon.front());
  return sum.twice_area;
}

bool contains(const Polygon& polygon, const Vector2d& point) {
  bool inside = false;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vector2d a = polygon[k] - point;
    const Vector2d b = polygon[(k + 1) % polygon.size()] - point;
    if ((a.y() > 0.0) == (b.y() > 0.0)) continue;
    if (a.x() + (b.x() - a.x()) * a.y() / (a.y() - b.y()) > 0.0) inside = !inside;
  }
  return inside;
}

Vector2d major_axis(const PlaneFigure& figure) {
  const double difference = figure.second_moment(0, 0) - figure.second_moment(1, 1);
  const double twice_product = 2.0 * figure.second_moment(0, 1);
  if (std::hypot(difference, twice_product) <= kRound * figure.second_moment.trace()) return Vector2d::UnitX();
  // The figure reaches farthest along this direction, in (-pi/2, pi/2] from x: bending about the axis across it is
  // hardest.
  const double angle = 0.5 * std::atan2(twice_product, difference);
  const Vector2d axis(std::sin(angle), -std::cos(angle));
  constexpr double kAcross = 0.6;  // not that of 45 degrees, where figures often are
  return axis.x() < -kAcross ? Vector2d(-axis) : axis;
}

}  // namespace layfigure::doll
