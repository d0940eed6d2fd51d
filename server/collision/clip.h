#pragma once

#include <Eigen/Core>
#include <vector>

#include "narrow_phase.h"

namespace layfigure::collision {

/// Fills scratch.polygon with what faces `face`: the facing face of the other core, or its edge or point, in a's body
/// frame; cut to the prism over the face, less what lies more than `slack` outside it. Corners keep the two lines that
/// they lie on, numbered by the facing loop's vertices, or from kFirstSide on by the face's sides: that names a corner
/// however it moves.
void clip_facing(const FaceRef& face, double slack, NarrowScratch& scratch);

inline constexpr int kFirstSide = 256;  ///< no facing loop has more vertices: see kMaxHullVertices
inline constexpr int kNoLine = 1023;    ///< at the ends of a facing edge, and of a point

}  // namespace layfigure::collision
