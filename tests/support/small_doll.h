#pragma once

#include "layfigure/doll/doll.h"

namespace layfigure::testing {

/// A doll of three bodies in a row along x, 0.2 m each, made by hand: "hips" (the pinned root), "spine" and "arm"; and
/// a bone "tip" at the end of the arm that has no body and rides on it. Its joints hold it against gravity and yield to
/// a pull of about 20 N at the tip. Its mesh is a strip of triangles along it.
[[nodiscard]] doll::Doll small_doll();

}  // namespace layfigure::testing
