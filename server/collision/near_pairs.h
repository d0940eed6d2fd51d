#pragma once

#include <span>
#include <utility>
#include <vector>

#include "moving_body.h"
#include "shape_set.h"
#include "sweep.h"

namespace layfigure::collision {

/// Two shapes whose bounds are near each other. `a` is an index into the cores; `b` too, or into the planes.
struct NearPair {
  std::pair<int, int> shapes;
  int a;
  int b;
  bool plane;
  std::pair<int, int> bodies;  ///< that carry them, counted from the world
  double apart;                ///< by their bounds, when it was listed; negative if these overlap [m]
};

/// The pairs that may come within the activity distance, in a list that stands for several updates: bounds are enlarged
/// by more than the bodies can reach in one (Verlet, Computer "experiments" on classical fluids, 1967), and a new list
/// is due only when some body has used up what it was given.
class NearPairs {
 public:
  /// Of a set that stays where it is.
  explicit NearPairs(const ShapeSet& shapes);

  /// No pair that is not listed can be within the activity distance before the next update. O(bodies).
  [[nodiscard]] bool hold(const std::vector<MovingBody>& bodies) const;
  /// Lists them anew. A sweep over the bounds.
  void find(const std::vector<MovingBody>& bodies, UpdateReport& report);
  /// Sorted by shapes.
  [[nodiscard]] std::span<const NearPair> list() const { return list_; }
  void forget() { listed_ = false; }

 private:
  /// How far a body may go, its reach included, from where it was when the list was made.
  struct Allowance {
    double travel;
    double margin;
  };

  void set_allowances(const std::vector<MovingBody>& bodies);
  void find_cores(const std::vector<MovingBody>& bodies, UpdateReport& report);
  void find_planes(const std::vector<MovingBody>& bodies, UpdateReport& report);

  const ShapeSet* shapes_;
  bool listed_{false};
  std::vector<Allowance> allowances_;
  Sweep sweep_;
  std::vector<Box> boxes_;  ///< of the cores, enlarged by half the activity distance and their bodies' margins
  std::vector<std::pair<int, int>> overlapping_;
  std::vector<NearPair> list_;
};

}  // namespace layfigure::collision
