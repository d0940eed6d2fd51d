#include "layfigure/skinning/posed_skin.h"

#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "layfigure/skinning/pose.h"
#include "topology.h"
#include "triangle_tree.h"

namespace layfigure::skinning {
namespace {

using character::Influence;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

double weight_of(const Skin& skin, int vertex, int bone) {
  double weight = 0.0;
  for (const Influence& i : skin.influences(vertex)) {
    if (i.bone == bone) weight += i.weight;
  }
  return weight;
}

/// Weights are linear over a triangle.
int heaviest_bone(const Skin& skin, const Vector3i& corners, const Vector3d& barycentric) {
  int heaviest = -1;
  double most = -1.0;
  for (const int corner : corners) {
    for (const Influence& i : skin.influences(corner)) {
      double weight = 0.0;
      for (int c = 0; c < 3; ++c) weight += barycentric[c] * weight_of(skin, corners[c], i.bone);
      if (weight > most || (weight == most && i.bone < heaviest)) {
        most = weight;
        heaviest = i.bone;
      }
    }
  }
  return heaviest;
}

/// Of the two vectors [rad], in [0, pi].
double angle_between(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

}  // namespace

struct PosedSkin::Data {
  Data(Skin the_skin, Blend the_blend)
      : skin(std::move(the_skin)),
        blend(the_blend),
        workspace(skin),
        positions(skin.bind_positions().begin(), skin.bind_positions().end()),
        topology(make_topology(skin)),
        tree(skin.triangles(), positions) {
    for (const character::Bone& bone : skin.bones()) X_WB.push_back(bone.bind);
  }

  void move();
  [[nodiscard]] Vector3d triangle_normal(int triangle) const;
  [[nodiscard]] Vector3d corner_normal(int point) const;
  [[nodiscard]] Vector3d pseudonormal(int triangle, const Vector3d& barycentric) const;
  [[nodiscard]] SkinPoint skin_point(int triangle, const Vector3d& barycentric) const;
  [[nodiscard]] Side side_of(const SkinPoint& nearest, const Vector3d& p_W) const;

  Skin skin;
  Blend blend;
  DeformWorkspace workspace;
  std::vector<Isometry3d> X_WB;
  std::vector<Vector3d> positions;
  Topology topology;
  TriangleTree tree;
};

void PosedSkin::Data::move() {
  deform(skin, X_WB, blend, workspace, positions);
  tree.refit(positions);
}

Vector3d PosedSkin::Data::triangle_normal(int triangle) const {
  const Vector3i& t = skin.triangles()[triangle];
  const Vector3d& a = positions[t[0]];
  return (positions[t[1]] - a).cross(positions[t[2]] - a).normalized();
}

Vector3d PosedSkin::Data::corner_normal(int point) const {
  Vector3d sum = Vector3d::Zero();
  for (const int triangle : topology.around(point)) {
    const Vector3i& t = skin.triangles()[triangle];
    for (int corner = 0; corner < 3; ++corner) {
      if (topology.corners[triangle][corner] != point) continue;
      const Vector3d& here = positions[t[corner]];
      const Vector3d to_next = positions[t[(corner + 1) % 3]] - here;
      const Vector3d to_last = positions[t[(corner + 2) % 3]] - here;
      sum += angle_between(to_next, to_last) * triangle_normal(triangle);
    }
  }
  return sum.normalized();
}

/// A coordinate of 0 says that the point is on the edge opposite to that corner, 1 that it is at the corner.
Vector3d PosedSkin::Data::pseudonormal(int triangle, const Vector3d& barycentric) const {
  for (int corner = 0; corner < 3; ++corner) {
    if (barycentric[corner] == 1.0) return corner_normal(topology.corners[triangle][corner]);
  }
  Vector3d normal = triangle_normal(triangle);
  for (int corner = 0; corner < 3; ++corner) {
    const int neighbour = topology.neighbours[triangle][corner];
    if (barycentric[corner] == 0.0 && neighbour >= 0) normal += triangle_normal(neighbour);
  }
  return normal.normalized();
}

SkinPoint PosedSkin::Data::skin_point(int triangle, const Vector3d& barycentric) const {
  const Vector3i& t = skin.triangles()[triangle];
  SkinPoint point;
  point.triangle = triangle;
  point.barycentric = barycentric;
  point.p_WS = barycentric[0] * positions[t[0]] + barycentric[1] * positions[t[1]] + barycentric[2] * positions[t[2]];
  point.normal_W = pseudonormal(triangle, barycentric);
  point.bone = heaviest_bone(skin, t, barycentric);
  point.p_BS = X_WB[point.bone].inverse() * point.p_WS;
  return point;
}

Side PosedSkin::Data::side_of(const SkinPoint& nearest, const Vector3d& p_W) const {
  if (!topology.closed[nearest.triangle]) return Side::kOpen;
  return (p_W - nearest.p_WS).dot(nearest.normal_W) < 0.0 ? Side::kInside : Side::kOutside;
}

PosedSkin::PosedSkin(Skin skin, Blend blend) : data_(std::make_unique<Data>(std::move(skin), blend)) {}
PosedSkin::~PosedSkin() = default;
PosedSkin::PosedSkin(PosedSkin&&) noexcept = default;
PosedSkin& PosedSkin::operator=(PosedSkin&&) noexcept = default;

const Skin& PosedSkin::skin() const { return data_->skin; }
std::span<const Isometry3d> PosedSkin::bone_poses() const { return data_->X_WB; }
std::span<const Vector3d> PosedSkin::positions() const { return data_->positions; }

void PosedSkin::pose(std::span<const Isometry3d> X_WB) {
  assert(X_WB.size() == data_->X_WB.size());
  std::copy(X_WB.begin(), X_WB.end(), data_->X_WB.begin());
  data_->move();
}

void PosedSkin::pose(const doll::SkeletonPose& pose) {
  skinning::bone_poses(data_->skin, pose, data_->X_WB);
  data_->move();
}

std::optional<SkinPoint> PosedSkin::closest_point(const Vector3d& p_W) const {
  const auto closest = data_->tree.closest(data_->positions, p_W);
  if (!closest) return std::nullopt;
  SkinPoint point = data_->skin_point(closest->triangle, closest->on_triangle.barycentric);
  point.distance = std::sqrt(closest->squared_distance);
  point.side = data_->side_of(point, p_W);
  return point;
}

std::optional<SkinPoint> PosedSkin::cast_ray(const Vector3d& origin_W, const Vector3d& direction_W) const {
  const Vector3d direction = direction_W.stableNormalized();
  if (!origin_W.allFinite() || !direction.allFinite() || direction.isZero()) return std::nullopt;
  const auto hit = data_->tree.cast(data_->positions, Ray(origin_W, direction));
  if (!hit) return std::nullopt;
  SkinPoint point = data_->skin_point(hit->triangle, hit->crossing.barycentric);
  point.distance = hit->crossing.distance;
  point.side = data_->side_of(point, point.p_WS - direction);
  return point;
}

GrabPoint PosedSkin::grab_point(const SkinPoint& touched, std::optional<int> bone) const {
  if (!bone) return {touched.bone, touched.p_BS};
  const int count = data_->skin.bone_count();
  if (*bone < 0 || *bone >= count) {
    throw std::invalid_argument("bone " + std::to_string(*bone) + ": expected 0 to " + std::to_string(count - 1));
  }
  return {*bone, data_->X_WB[*bone].inverse() * touched.p_WS};
}

}  // namespace layfigure::skinning
