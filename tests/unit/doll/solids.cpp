#include "solids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

namespace layfigure::doll::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

/// Adds the points of a face of the box that are not there yet.
class BoxMaker {
 public:
  BoxMaker(const Vector3d& size, int cells) : size_(size), cells_(cells) {}

  /// The side of the cube at `level` (0 or `cells`) along `axis`.
  void add_side(int axis, int level) {
    for (int i = 0; i < cells_; ++i) {
      for (int j = 0; j < cells_; ++j) {
        const auto corner = [&](int di, int dj) { return point(axis, level, i + di, j + dj); };
        std::array<Vector3i, 2> pair{Vector3i(corner(0, 0), corner(1, 0), corner(1, 1)),
                                     Vector3i(corner(0, 0), corner(1, 1), corner(0, 1))};
        for (Vector3i& t : pair) {
          if (level == 0) std::swap(t[0], t[1]);
          solid_.triangles.push_back(t);
        }
      }
    }
  }

  [[nodiscard]] const Solid& solid() const { return solid_; }

 private:
  int point(int axis, int level, int i, int j) {
    std::array<int, 3> at{};
    at[axis] = level;
    at[(axis + 1) % 3] = i;
    at[(axis + 2) % 3] = j;
    const auto [entry, is_new] = known_.try_emplace(at, static_cast<int>(solid_.points.size()));
    if (is_new) {
      const Vector3d share = Vector3d(at[0], at[1], at[2]) / cells_ - Vector3d::Constant(0.5);
      solid_.points.emplace_back(size_.cwiseProduct(share));
    }
    return entry->second;
  }

  Vector3d size_;
  int cells_;
  Solid solid_;
  std::map<std::array<int, 3>, int> known_;
};

int rows_of(double length, double radius, int sides) {
  const double facet = 2.0 * std::numbers::pi * radius / sides;
  return std::max(1, static_cast<int>(std::lround(length / facet / 8.0)));
}

/// From (z, radius) to the next row's, both excluded.
void add_rows(const Turn& from, const Turn& to, int rows, std::vector<Turn>& profile) {
  for (int k = 1; k < rows; ++k) {
    const double f = static_cast<double>(k) / rows;
    profile.push_back({(1.0 - f) * from.z + f * to.z, (1.0 - f) * from.radius + f * to.radius});
  }
}

character::Bone make_bone(const char* name, int parent, double height) {
  character::Bone bone;
  bone.name = name;
  bone.parent = parent;
  bone.bind =
      Eigen::Translation3d(0, 0, height) * Isometry3d((Eigen::Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished());
  return bone;
}

}  // namespace

Solid turned(const std::vector<Turn>& profile, int sides, bool closed) {
  Solid solid;
  std::vector<std::vector<int>> rows;
  for (const Turn& turn : profile) {
    std::vector<int>& row = rows.emplace_back();
    for (int k = 0; k < sides; ++k) {
      if (turn.radius > 0.0 || k == 0) {
        const double angle = 2.0 * std::numbers::pi * k / sides;
        solid.points.emplace_back(turn.radius * std::cos(angle), turn.radius * std::sin(angle), turn.z);
      }
      row.push_back(static_cast<int>(solid.points.size()) - 1);
    }
  }
  const std::size_t strips = closed ? rows.size() : rows.size() - 1;
  for (std::size_t r = 0; r < strips; ++r) {
    const std::vector<int>& low = rows[r];
    const std::vector<int>& high = rows[(r + 1) % rows.size()];
    for (int k = 0; k < sides; ++k) {
      const int next = (k + 1) % sides;
      if (low[k] != low[next]) solid.triangles.emplace_back(low[k], low[next], high[next]);
      if (high[k] != high[next]) solid.triangles.emplace_back(low[k], high[next], high[k]);
    }
  }
  return solid;
}

Solid box(const Vector3d& size, int cells) {
  BoxMaker maker(size, cells);
  for (int axis = 0; axis < 3; ++axis) {
    maker.add_side(axis, 0);
    maker.add_side(axis, cells);
  }
  return maker.solid();
}

Solid cylinder(double radius, double length, int sides) {
  std::vector<Turn> profile{{-length / 2, 0.0}, {-length / 2, radius}};
  add_rows({-length / 2, radius}, {length / 2, radius}, rows_of(length, radius, sides), profile);
  profile.insert(profile.end(), {{length / 2, radius}, {length / 2, 0.0}});
  return turned(profile, sides);
}

Solid tube(double outer, double inner, double length, int sides) {
  const int rows = std::max(1, rows_of(length, outer, sides) / 2);
  std::vector<Turn> profile{{-length / 2, outer}};
  add_rows({-length / 2, outer}, {length / 2, outer}, rows, profile);
  profile.insert(profile.end(), {{length / 2, outer}, {length / 2, inner}});
  add_rows({length / 2, inner}, {-length / 2, inner}, rows, profile);
  profile.push_back({-length / 2, inner});
  return turned(profile, sides, true);
}

Solid capsule(double radius, double length, int sides) {
  const int rows = sides / 8;
  std::vector<Turn> profile;
  for (int k = 0; k <= rows; ++k) {
    const double latitude = std::numbers::pi / 2 * (k - rows) / rows;
    profile.push_back({-length / 2 + radius * std::sin(latitude), k == 0 ? 0.0 : radius * std::cos(latitude)});
  }
  for (int k = rows; k >= 0; --k) profile.push_back({-profile[k].z, profile[k].radius});
  return turned(profile, sides);
}

Solid stretched(Solid solid, const Vector3d& factors) {
  for (Vector3d& point : solid.points) point = point.cwiseProduct(factors);
  return solid;
}

character::Rig rig_of(const Solid& solid, double joint) {
  double lowest = joint;
  for (const Vector3d& point : solid.points) lowest = std::min(lowest, point.z());
  character::Rig rig;
  rig.name = "solid";
  rig.source_file = "solid.glb";
  rig.bones = {make_bone("bone0", -1, lowest), make_bone("bone1", 0, joint)};
  rig.bones[0].rest = rig.bones[0].bind;
  rig.bones[1].rest = rig.bones[0].bind.inverse() * rig.bones[1].bind;
  character::SkinnedMesh mesh;
  mesh.name = "solid";
  mesh.vertices = solid.points;
  mesh.triangles = solid.triangles;
  for (const Vector3d& point : solid.points) {
    // Within a tenth of a facet of any of the solids: on the ring at the joint.
    constexpr double kAtJoint = 1e-4;
    if (std::abs(point.z() - joint) < kAtJoint) {
      mesh.influences.push_back({{0, 0.5}, {1, 0.5}});
    } else {
      mesh.influences.push_back({{point.z() < joint ? 0 : 1, 1.0}});
    }
  }
  rig.meshes.push_back(mesh);
  return rig;
}

}  // namespace layfigure::doll::test
