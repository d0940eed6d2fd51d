#pragma once

#include <span>
#include <vector>

namespace layfigure::dynamics {

/// Which body of which copy of the doll a SIMD lane works on.
struct Task {
  int copy{0};
  int body{0};
  int parent_slot{0};
  int parent_lane{0};
  bool idle{true};  ///< nothing comes of it; body 0 of copy 0 is there to be read
};

/// An order of work for `copies` copies of one tree, in slots of `lanes` bodies that are worked on side by side:
/// parents in earlier slots than their children, so that the same order serves both sweeps. It fills the lanes with
/// whatever is ready: limbs beside each other, and the runs of an extrapolation. Slot size() stands for the world.
class Schedule {
 public:
  /// What stands for the parent of a body that has no place in the schedule.
  static constexpr int kAbsent = -2;

  /// List scheduling, the longest remaining path first. O(copies n log n). `lanes`: a power of 2. `parents` in tree
  /// order, -1 for roots, kAbsent for bodies to leave out, which are nobody's parents.
  Schedule(const std::vector<int>& parents, int copies, int lanes);
  /// Arranges as many bodies anew; allocates nothing where a body more is absent than before.
  void arrange(const std::vector<int>& parents);

  [[nodiscard]] int size() const { return static_cast<int>(aligned_.size()); }
  [[nodiscard]] int lanes() const { return lanes_; }
  [[nodiscard]] int copies() const { return copies_; }
  [[nodiscard]] const Task* tasks(int slot) const { return &tasks_[slot * lanes_]; }
  /// Every lane's parent is in the same lane of one slot: whole packs can be passed on.
  [[nodiscard]] bool aligned(int slot) const { return aligned_[slot]; }
  /// Where an aligned slot's parents are; size() if they are the world.
  [[nodiscard]] int parent_slot(int slot) const { return parent_slot_[slot]; }
  /// Some slot that is not aligned has parents here; size(): the world.
  [[nodiscard]] bool read_by_lane(int slot) const { return read_by_lane_[slot]; }
  /// The children of the bodies here are, one after the other, in whole slots that are aligned to this one.
  [[nodiscard]] bool adds_whole(int slot) const { return adds_whole_[slot]; }
  /// It is one of those, so that its parents take it whole.
  [[nodiscard]] bool passed_whole(int slot) const { return passed_whole_[slot]; }
  /// The first lane that does not idle.
  [[nodiscard]] int busy_lane(int slot) const {
    int lane = 0;
    while (tasks(slot)[lane].idle) ++lane;
    return lane;
  }
  /// Places (slot lanes + lane) of the children of the body in a lane, in tree order.
  [[nodiscard]] std::span<const int> children(int slot, int lane) const {
    const int place = slot * lanes_ + lane;
    return {children_.data() + first_child_place_[place], children_.data() + first_child_place_[place + 1]};
  }
  [[nodiscard]] int slot_of(int copy, int body) const { return place_[copy * bodies_ + body] >> lane_bits_; }
  [[nodiscard]] int lane_of(int copy, int body) const { return place_[copy * bodies_ + body] & (lanes_ - 1); }

 private:
  /// A body that may be put into a slot.
  struct Ready {
    int height;
    int copy;
    int body;
    [[nodiscard]] bool operator<(const Ready& other) const;
  };

  void measure_heights(const std::vector<int>& parents);
  void make_ready(const Ready& task);
  [[nodiscard]] Ready take_first();
  void fill_slot(const std::vector<int>& parents);
  void link_parents(const std::vector<int>& parents);
  void link_children(const std::vector<int>& parents);
  [[nodiscard]] bool is_aligned(int slot) const;
  [[nodiscard]] bool has_whole_children(int slot) const;

  int lanes_;
  int lane_bits_;  ///< its logarithm: a division for each place would cost a step more than one might think
  int copies_;
  int bodies_;
  std::vector<Task> tasks_;  ///< slot by slot
  std::vector<int> place_;   ///< slot * lanes + lane, of each body of each copy
  std::vector<char> aligned_;
  std::vector<int> parent_slot_;
  std::vector<char> read_by_lane_;
  std::vector<char> adds_whole_;
  std::vector<char> passed_whole_;
  std::vector<int> first_child_place_;  ///< in children_, of each place and of the end
  std::vector<int> children_;
  // scratch of arrange()
  std::vector<int> height_;  ///< length of the longest path from each body down to a leaf
  std::vector<int> first_child_;
  std::vector<int> next_sibling_;
  std::vector<Ready> ready_;  ///< a heap
  std::vector<Ready> chosen_;
};

}  // namespace layfigure::dynamics
