#pragma once

#include "creation_bound.h"
#include "rigid_groups.h"
#include "run.h"

namespace layfigure::dynamics {

/// The plan of so many copies of the groups.
template <class T>
[[nodiscard]] Plan<T> make_plan(const Model& model, const RigidGroups& groups, const Levers& levers, int copies);

/// Makes it that of other groups of the same model. O(n log n); allocates nothing where more bodies ride than when it
/// was made.
template <class T>
void arrange(const Model& model, const RigidGroups& groups, const Levers& levers, Plan<T>& plan);

}  // namespace layfigure::dynamics
