#pragma once

#include <vector>

namespace layfigure::dynamics {

/// Which body of which copy of the doll a SIMD lane works on.
struct Task {
  int copy{-1};  ///< -1: the lane is idle
  int body{-1};
  int parent_slot{0};
  int parent_lane{0};
};

/// An order of work for `copies` copies of one tree, in slots of `lanes` bodies that are worked on side by side:
/// parents in earlier slots than their children, so that the same order serves both sweeps. It fills the lanes with
/// whatever is ready: limbs beside each other, and the runs of an extrapolation. Slot size() stands for the world.
class Schedule {
 public:
  /// List scheduling, the longest remaining path first. O(copies n log n). `parents` in tree order, -1 for roots.
  Schedule(const std::vector<int>& parents, int copies, int lanes);

  [[nodiscard]] int size() const { return static_cast<int>(aligned_.size()); }
  [[nodiscard]] int lanes() const { return lanes_; }
  [[nodiscard]] int copies() const { return copies_; }
  [[nodiscard]] const Task* tasks(int slot) const { return &tasks_[slot * lanes_]; }
  /// Every lane's parent is in the same lane of one slot: whole packs can be passed on.
  [[nodiscard]] bool aligned(int slot) const { return aligned_[slot]; }
  /// Where an aligned slot's parents are; size() if they are the world.
  [[nodiscard]] int parent_slot(int slot) const { return parent_slot_[slot]; }
  [[nodiscard]] int slot_of(int copy, int body) const { return place_[copy * bodies_ + body] / lanes_; }
  [[nodiscard]] int lane_of(int copy, int body) const { return place_[copy * bodies_ + body] % lanes_; }

 private:
  [[nodiscard]] bool is_aligned(int slot) const;

  int lanes_;
  int copies_;
  int bodies_;
  std::vector<Task> tasks_;  ///< slot by slot
  std::vector<int> place_;   ///< slot * lanes + lane, of each body of each copy
  std::vector<char> aligned_;
  std::vector<int> parent_slot_;
};

}  // namespace layfigure::dynamics
