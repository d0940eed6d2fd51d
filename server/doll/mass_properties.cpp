#include "mass_properties.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

namespace layfigure::doll {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kLeastSphereShare = 0.02;  // a plate 1/200 as thick as wide
constexpr double kLeastHalfSide = 0.05;     // of the longest

/// Directed edges without an opposite one, by their first vertex; an edge that occurs k times more often than its
/// opposite is there k times. As many leave each vertex as arrive, so they are closed loops.
using Boundary = std::map<int, std::vector<int>>;

Boundary find_boundary(std::span<const Vector3i> part) {
  std::map<std::pair<int, int>, int> net;  // of (a, b), a < b: how often a -> b, less how often b -> a
  for (const Vector3i& t : part) {
    for (int k = 0; k < 3; ++k) {
      const int a = t[k];
      const int b = t[(k + 1) % 3];
      net[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  }
  Boundary boundary;
  for (const auto& [edge, count] : net) {
    const auto [from, to] = count > 0 ? edge : std::pair(edge.second, edge.first);
    boundary[from].insert(boundary[from].end(), std::abs(count), to);
  }
  std::erase_if(boundary, [](const auto& entry) { return entry.second.empty(); });
  return boundary;
}

/// Takes one loop out of the boundary, as its vertices in order.
std::vector<int> take_loop(Boundary& boundary) {
  std::vector<int> loop;
  const int start = boundary.begin()->first;
  int vertex = start;
  do {
    loop.push_back(vertex);
    const auto leaving = boundary.find(vertex);
    vertex = leaving->second.back();
    leaving->second.pop_back();
    if (leaving->second.empty()) boundary.erase(leaving);
  } while (vertex != start);
  return loop;
}

/// Centroid of a closed polygon's edges, each weighted by its length.
Vector3d loop_centroid(const std::vector<int>& loop, const std::vector<Vector3d>& points) {
  Vector3d sum = Vector3d::Zero();
  double length = 0.0;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const Vector3d& a = points[loop[k]];
    const Vector3d& b = points[loop[(k + 1) % loop.size()]];
    sum += (b - a).norm() * 0.5 * (a + b);
    length += (b - a).norm();
  }
  return length > 0.0 ? Vector3d(sum / length) : points[loop.front()];
}

struct Integrals {
  double volume{0.0};
  double area{0.0};
  Vector3d first{Vector3d::Zero()};
  Matrix3d second{Matrix3d::Zero()};

  void add(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    const double v = a.dot(b.cross(c)) / 6.0;
    const Vector3d s = a + b + c;
    volume += v;
    area += 0.5 * (b - a).cross(c - a).norm();
    first += v / 4.0 * s;
    second += v / 20.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
};

Matrix3d inertia_of(const Matrix3d& second) { return second.trace() * Matrix3d::Identity() - second; }

/// Two hemispheres of radius r with a cylinder of length h between them, along z.
MassProperties capsule(double r, double h) {
  const double ball = 4.0 / 3.0 * std::numbers::pi * r * r * r;
  const double cylinder = std::numbers::pi * r * r * h;
  const double along = 0.4 * ball * r * r + 0.5 * cylinder * r * r;
  // A hemisphere's com is 3/8 r from its flat side: by the parallel axis theorem to there and back out to the end.
  const double across = ball * (0.4 * r * r + 0.25 * h * h + 0.375 * h * r) + cylinder * (0.25 * r * r + h * h / 12.0);
  MassProperties result;
  result.volume = ball + cylinder;
  result.inertia = Vector3d(across, across, along).asDiagonal();
  return result;
}

MassProperties bounding_capsule(std::span<const Vector3i> part, const std::vector<Vector3d>& points,
                                const Matrix3d& axes) {
  Eigen::AlignedBox3d box;
  for (const Vector3i& t : part) {
    for (const int corner : t) box.extend(axes.transpose() * points[corner]);
  }
  Vector3d half = 0.5 * box.sizes();
  int longest = 0;
  const double most = half.maxCoeff(&longest);
  half = half.cwiseMax(std::max(kLeastHalfSide * most, std::numeric_limits<double>::min()));
  const int x = (longest + 1) % 3;
  const int y = (longest + 2) % 3;
  // An ellipse of the half sides a and b has the area of the circle of radius sqrt(a b).
  const double radius = std::sqrt(half[x]) * std::sqrt(half[y]);
  MassProperties result = capsule(radius, std::max(2.0 * (half[longest] - radius), 0.0));
  Matrix3d R;
  R << axes.col(x), axes.col(y), axes.col(longest);
  result.estimated = true;
  result.com = axes * box.center();
  result.inertia = (R * result.inertia * R.transpose()).eval();
  return result;
}

Vector3d middle_of(std::span<const Vector3i> part, const std::vector<Vector3d>& points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3i& t : part) sum += points[t[0]] + points[t[1]] + points[t[2]];
  return sum / (3.0 * static_cast<double>(part.size()));
}

}  // namespace

std::vector<std::vector<int>> boundary_loops(std::span<const Vector3i> part) {
  std::vector<std::vector<int>> loops;
  Boundary boundary = find_boundary(part);
  while (!boundary.empty()) loops.push_back(take_loop(boundary));
  return loops;
}

MassProperties mass_properties(std::span<const Vector3i> part, const std::vector<Vector3d>& points,
                               const Matrix3d& axes) {
  const Vector3d middle = middle_of(part, points);  // near the part: no digits lost far from the origin
  Integrals sum;
  for (const Vector3i& t : part) sum.add(points[t[0]] - middle, points[t[1]] - middle, points[t[2]] - middle);
  for (const std::vector<int>& loop : boundary_loops(part)) {
    const Vector3d centre = loop_centroid(loop, points) - middle;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      sum.add(points[loop[(k + 1) % loop.size()]] - middle, points[loop[k]] - middle, centre);
    }
  }

  const double sphere = std::pow(sum.area, 1.5) / (6.0 * std::sqrt(std::numbers::pi));
  if (!(sum.volume > kLeastSphereShare * sphere)) return bounding_capsule(part, points, axes);
  const Vector3d com = sum.first / sum.volume;
  const Matrix3d second = sum.second - sum.volume * com * com.transpose();
  // Positive second moments make an inertia that obeys the triangle inequality.
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(second, Eigen::EigenvaluesOnly);
  if (!(eigen.eigenvalues()[0] > 0.0)) return bounding_capsule(part, points, axes);
  return {sum.volume, middle + com, inertia_of(second), false};
}

}  // namespace layfigure::doll
