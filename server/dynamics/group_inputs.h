#pragma once

#include <vector>

#include "rigid_groups.h"
#include "run.h"

namespace layfigure::dynamics {

/// Inputs of a step with what acts on riders acting on their carriers instead: the same forces at the same points. The
/// joint of a rider does not turn: what drives it exerts nothing.
class GroupInputs {
 public:
  /// Makes room for so many inputs.
  void reserve(const Inputs& inputs);
  /// `inputs` itself where nothing rides. The result holds until the next call. Allocates nothing within the reserved
  /// room.
  const Inputs& map(const Inputs& inputs, const RigidGroups& groups);

 private:
  Inputs mapped_;
  std::vector<Coupling> couplings_;
  std::vector<Contact> contacts_;
  std::vector<Tie> ties_;
  std::vector<Drive> drives_;
};

/// The same for the loads of a copy, whose bodies have been set.
void carry_loads(const RigidGroups& groups, Copy& copy);

}  // namespace layfigure::dynamics
