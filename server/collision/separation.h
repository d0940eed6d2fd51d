#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>

#include "narrow_phase.h"
#include "segments.h"

namespace layfigure::collision {

/// The points of a contact change only for gains above this, relative to the smaller shape's size: a hundred times the
/// motion of a body at rest, too small to be seen.
inline constexpr double kPointHysteresis = 1e-4;

/// Its face changes only for gains above this: they are lost to the gap, which is to be good to a micrometre.
inline constexpr double kFaceHysteresis = 1e-5;

/// The size that both are relative to: of the smaller core, radius included [m].
[[nodiscard]] double smaller_size(const std::array<PlacedCore, 2>& cores);

/// min over a's vertices of n . v  -  max over b's vertices of n . v: a lower bound of the cores' signed distance.
[[nodiscard]] double separation_along(const std::array<PlacedCore, 2>& cores, const Eigen::Vector3d& n);

/// The same before the vertices have been placed: a third of the work.
[[nodiscard]] double unplaced_separation_along(const std::array<PlacedCore, 2>& cores, const Eigen::Vector3d& n);

/// A face and the signed distance of the other core from its plane.
struct FaceSeparation {
  FaceRef face;
  double separation{-std::numeric_limits<double>::infinity()};
  int support{0};  ///< the other core's vertex that is deepest
};

/// That of one face, `facing` left open. O(vertices).
[[nodiscard]] FaceSeparation separation_of(const std::array<PlacedCore, 2>& cores, int side, int face);

/// The face with the largest separation, or `preferred` unless another's is larger: by the hysteresis, if that is a
/// face. Stops at the first one beyond `reach`. Side -1 if neither core has a face. O(faces): the other core's vertices
/// are gone through only for a face that the last one found low lies high enough above.
[[nodiscard]] FaceSeparation largest_face_separation(const std::array<PlacedCore, 2>& cores,
                                                     const FaceSeparation& preferred, double reach);

/// Two edges, and the axis between them.
struct EdgeSeparation {
  double separation{-std::numeric_limits<double>::infinity()};  ///< along the normal
  double distance{std::numeric_limits<double>::infinity()};     ///< of the edges, if known: none parts them by more
  ClosestPoints points{};                                       ///< of the edges, if it is
  Eigen::Vector3d normal{Eigen::Vector3d::Zero()};              ///< unit, from b to a
  EdgePair edges{};
};

/// That of two given edges, along the direction between their closest points or, where the cores touch there, square
/// to both; the normal looks along `direction`. The separation is minus infinity if they have no such normal.
/// O(vertices).
[[nodiscard]] EdgeSeparation separation_of(const std::array<PlacedCore, 2>& cores, const EdgePair& edges,
                                           const Eigen::Vector3d& direction);

/// Whether a face about the ends of the two edges, whose closest points are known, parts the cores by more than
/// `least`. O(1) where none does.
[[nodiscard]] bool some_face_about(const std::array<PlacedCore, 2>& cores, const EdgeSeparation& edges, double least);

/// The largest separation along the directions between two edges: of their closest points, or, where the cores touch
/// or overlap, square to both. `direction`, unit, points from b to a; where there are many edges it should be about
/// the answer. Where the separation is positive and equals the edges' distance it is the cores' distance.
[[nodiscard]] EdgeSeparation largest_edge_separation(NarrowScratch& scratch, const Eigen::Vector3d& direction);

/// True if there are few enough edges to try all of them: no good direction is needed.
[[nodiscard]] bool tries_all_edges(const std::array<PlacedCore, 2>& cores);

}  // namespace layfigure::collision
