#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "polytope.h"
#include "separating_direction.h"

namespace layfigure::collision {

/// Most points that a pair of shapes has.
inline constexpr int kLayerPoints = 4;
inline constexpr int kMaxPoints = 2 * kLayerPoints;

/// Which points of a pair are reported.
struct Activity {
  double distance;  ///< those with a gap up to this [m]
  double layer;     ///< those not more than this above the deepest come first [m]
};

/// A face of one of two cores.
struct FaceRef {
  int side{-1};  ///< 0: a's, 1: b's, -1: none
  int face{-1};
  int facing{-1};  ///< the face of the other core that lies against it, -1: an edge or a vertex does
  bool operator==(const FaceRef&) const = default;
};

/// An edge of each of two cores, by its vertices: a's and b's.
using EdgePair = std::array<std::pair<int, int>, 2>;

/// A contact point in a's body frame.
struct LocalPoint {
  Eigen::Vector3d on_a;
  Eigen::Vector3d on_b;
  Eigen::Vector3d normal;  ///< from b to a
  double gap;
  std::uint64_t feature;
};

/// The contact of a pair, and what its next test remembers of it.
struct Manifold {
  static constexpr double kTouching = -std::numeric_limits<double>::infinity();

  FaceRef face;                                         ///< that the points lie on; side -1 if they lie on edges
  EdgePair edges{};                                     ///< these
  Eigen::Vector3d separating{Eigen::Vector3d::Zero()};  ///< a's body frame: held the cores apart, where count is 0
  double apart{kTouching};  ///< the shapes are at least so far apart, where that is beyond the activity distance [m]
  int count{0};
  std::array<LocalPoint, kMaxPoints> points;
};

/// One of the two cores of a test, placed in a's body frame.
struct PlacedCore {
  const Polytope* core;
  const ShrunkCore* shrunk;
  Eigen::Matrix3d R;
  Eigen::Vector3d p;
  std::span<const Eigen::Vector3d> vertices;  ///< left to collide()

  [[nodiscard]] Eigen::Vector3d normal(int face) const { return R * core->faces[face].normal; }
  [[nodiscard]] Eigen::Vector3d center() const { return R * core->center + p; }
};

/// A corner of a polygon that is being clipped, and the two lines it lies on: see clip_facing().
struct Corner {
  Eigen::Vector3d p;
  int before;
  int after;
  double outside;  ///< the largest of its signed distances from the sides it was clipped at, positive outside [m]
};

/// Scratch memory of the narrow phase, reused from test to test.
struct NarrowScratch {
  std::array<PlacedCore, 2> cores;
  std::vector<Eigen::Vector3d> vertices;  ///< b's
  std::vector<Corner> polygon;
  std::vector<Corner> clipped;
  std::vector<LocalPoint> points;
  std::array<std::vector<std::pair<int, int>>, 2> edges;  ///< that may hold the closest points
  int direction_searches{0};
};

/// Puts a in the scratch memory, and b in a's body frame.
void place(const Polytope& a, const ShrunkCore& shrunk_a, const Polytope& b, const ShrunkCore& shrunk_b,
           const Eigen::Matrix3d& R_AB, const Eigen::Vector3d& p_AB, NarrowScratch& scratch);

/// Replaces `manifold`, which holds the pair's last one, by that of the two cores placed in `scratch`.
void collide(const Activity& activity, NarrowScratch& scratch, Manifold& manifold);

/// The same for a core against the half-space normal . x <= offset, both in the core's body frame; the half-space is b.
void collide_with_plane(const Polytope& a, const Eigen::Vector3d& normal, double offset, const Activity& activity,
                        NarrowScratch& scratch, Manifold& manifold);

}  // namespace layfigure::collision
