#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace layfigure::collision {

/// A box along the world's axes [m].
struct Box {
  Eigen::Vector3d low;
  Eigen::Vector3d high;
};

[[nodiscard]] inline bool overlap(const Box& a, const Box& b) {
  return (a.low.array() <= b.high.array()).all() && (b.low.array() <= a.high.array()).all();
}

/// Finds the boxes that overlap: sorted along the axis on which they are spread most, each is compared with those that
/// begin before it ends.
class Sweep {
 public:
  explicit Sweep(int boxes);

  /// Appends the pairs (i < j) of overlapping boxes to `pairs`; returns how many pairs were compared. O(n + pairs
  /// compared) where the boxes' order is about that of the last time, at most O(n^2).
  int find(const std::vector<Box>& boxes, std::vector<std::pair<int, int>>& pairs);

 private:
  std::vector<int> order_;
};

}  // namespace layfigure::collision
