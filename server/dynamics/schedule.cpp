#include "schedule.h"

#include <algorithm>
#include <bit>
#include <tuple>

namespace layfigure::dynamics {
namespace {

constexpr int kNone = -1;

}  // namespace

/// The highest first, then in tree order and copy by copy, so that copies of a body, whose children are as high too, go
/// side by side.
bool Schedule::Ready::operator<(const Ready& other) const {
  return std::tie(height, other.body, other.copy) < std::tie(other.height, body, copy);
}

Schedule::Schedule(const std::vector<int>& parents, int copies, int lanes)
    : lanes_(lanes),
      lane_bits_(std::countr_zero(static_cast<unsigned>(lanes))),
      copies_(copies),
      bodies_(static_cast<int>(parents.size())),
      place_(copies * parents.size()) {
  ready_.reserve(place_.size());
  chosen_.reserve(lanes);
  arrange(parents);
}

void Schedule::arrange(const std::vector<int>& parents) {
  tasks_.clear();
  aligned_.clear();
  parent_slot_.clear();
  measure_heights(parents);
  for (int copy = 0; copy < copies_; ++copy) {
    for (int i = 0; i < bodies_; ++i) {
      if (parents[i] == -1) make_ready({height_[i], copy, i});
    }
  }
  while (!ready_.empty()) fill_slot(parents);
  link_parents(parents);
  link_children(parents);
}

void Schedule::measure_heights(const std::vector<int>& parents) {
  height_.assign(bodies_, 0);
  first_child_.assign(bodies_, kNone);
  next_sibling_.assign(bodies_, kNone);
  for (int i = bodies_ - 1; i >= 0; --i) {
    const int parent = parents[i];
    if (parent < 0) continue;
    height_[parent] = std::max(height_[parent], height_[i] + 1);
    next_sibling_[i] = first_child_[parent];
    first_child_[parent] = i;
  }
}

void Schedule::make_ready(const Ready& task) {
  ready_.push_back(task);
  std::push_heap(ready_.begin(), ready_.end());
}

Schedule::Ready Schedule::take_first() {
  std::pop_heap(ready_.begin(), ready_.end());
  const Ready first = ready_.back();
  ready_.pop_back();
  return first;
}

/// A body takes its parent's lane if it can, so that packs stay aligned.
void Schedule::fill_slot(const std::vector<int>& parents) {
  const int slot = static_cast<int>(tasks_.size()) / lanes_;
  tasks_.resize(tasks_.size() + lanes_);
  Task* const lane = &tasks_[slot * lanes_];
  const auto put = [&](const Ready& task, int k) {
    lane[k].copy = task.copy;
    lane[k].body = task.body;
    lane[k].idle = false;
    place_[task.copy * bodies_ + task.body] = slot * lanes_ + k;
  };
  const auto wanted_lane = [&](const Ready& task) {
    const int parent = parents[task.body];
    return parent < 0 ? task.copy % lanes_ : lane_of(task.copy, parent);
  };
  chosen_.clear();
  while (static_cast<int>(chosen_.size()) < lanes_ && !ready_.empty()) chosen_.push_back(take_first());
  for (const Ready& task : chosen_) {
    if (lane[wanted_lane(task)].idle) put(task, wanted_lane(task));
  }
  int free = 0;
  for (const Ready& task : chosen_) {
    const Task& there = lane[wanted_lane(task)];
    if (there.copy == task.copy && there.body == task.body) continue;
    while (!lane[free].idle) ++free;
    put(task, free);
  }
  for (const Ready& task : chosen_) {
    for (int child = first_child_[task.body]; child != kNone; child = next_sibling_[child]) {
      make_ready({height_[child], task.copy, child});
    }
  }
}

void Schedule::link_parents(const std::vector<int>& parents) {
  const int slots = static_cast<int>(tasks_.size()) / lanes_;
  for (std::size_t k = 0; k < tasks_.size(); ++k) {
    Task& task = tasks_[k];
    const int parent = task.idle ? -1 : parents[task.body];
    task.parent_slot = parent < 0 ? slots : slot_of(task.copy, parent);
    task.parent_lane = parent < 0 ? static_cast<int>(k) % lanes_ : lane_of(task.copy, parent);
  }
  read_by_lane_.assign(slots + 1, 0);
  for (int slot = 0; slot < slots; ++slot) {
    parent_slot_.push_back(tasks(slot)[busy_lane(slot)].parent_slot);
    aligned_.push_back(is_aligned(slot));
    if (aligned_.back()) continue;
    for (int k = 0; k < lanes_; ++k) read_by_lane_[tasks(slot)[k].parent_slot] = 1;
  }
}

/// Bodies are gone through in tree order, so each body's children are noted in it.
void Schedule::link_children(const std::vector<int>& parents) {
  const int slots = size();
  first_child_place_.assign(tasks_.size() + 1, 0);
  const auto for_children = [&](const auto& visit) {
    for (int copy = 0; copy < copies_; ++copy) {
      for (int i = 0; i < bodies_; ++i) {
        if (parents[i] >= 0) visit(place_[copy * bodies_ + parents[i]], place_[copy * bodies_ + i]);
      }
    }
  };
  for_children([&](int parent, int) { ++first_child_place_[parent + 1]; });
  for (std::size_t k = 0; k < tasks_.size(); ++k) first_child_place_[k + 1] += first_child_place_[k];
  children_.resize(first_child_place_.back());
  for_children([&](int parent, int child) { children_[first_child_place_[parent]++] = child; });
  for (std::size_t k = tasks_.size(); k > 0; --k) first_child_place_[k] = first_child_place_[k - 1];
  first_child_place_[0] = 0;
  adds_whole_.assign(slots, 0);
  passed_whole_.assign(slots, 0);
  for (int slot = 0; slot < slots; ++slot) {
    adds_whole_[slot] = has_whole_children(slot);
    if (!adds_whole_[slot]) continue;
    for (int k = 0; k < lanes_; ++k) {
      for (const int child : children(slot, k)) passed_whole_[child / lanes_] = 1;
    }
  }
}

bool Schedule::is_aligned(int slot) const {
  for (int k = 0; k < lanes_; ++k) {
    const Task& task = tasks(slot)[k];
    if (!task.idle && (task.parent_lane != k || task.parent_slot != parent_slot_[slot])) return false;
  }
  return true;
}

bool Schedule::has_whole_children(int slot) const {
  const std::span<const int> first = children(slot, busy_lane(slot));
  for (int k = 0; k < lanes_; ++k) {
    const std::span<const int> own = children(slot, k);
    const bool idle = tasks(slot)[k].idle;
    if (!idle && own.size() != first.size()) return false;
    for (std::size_t j = 0; j < first.size(); ++j) {
      const int child = first[j] / lanes_;
      // An idle lane passes on nonsense: harmless only where its parent's lane idles too.
      if (idle ? !tasks(child)[k].idle : own[j] != child * lanes_ + k) return false;
    }
  }
  return true;
}

}  // namespace layfigure::dynamics
