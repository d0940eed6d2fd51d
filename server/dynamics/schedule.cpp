#include "schedule.h"

#include <algorithm>
#include <queue>
#include <tuple>

namespace layfigure::dynamics {
namespace {

/// Length of the longest path from each body down to a leaf.
std::vector<int> heights(const std::vector<int>& parents) {
  std::vector<int> height(parents.size(), 0);
  for (int i = static_cast<int>(parents.size()) - 1; i >= 0; --i) {
    if (parents[i] >= 0) height[parents[i]] = std::max(height[parents[i]], height[i] + 1);
  }
  return height;
}

struct Ready {
  int height;
  int copy;
  int body;
  /// The highest first, then copy by copy and in tree order, so that the schedule is the same every time.
  bool operator<(const Ready& other) const {
    return std::tie(height, other.copy, other.body) < std::tie(other.height, copy, body);
  }
};

}  // namespace

Schedule::Schedule(const std::vector<int>& parents, int copies, int lanes)
    : lanes_(lanes), copies_(copies), bodies_(static_cast<int>(parents.size())), place_(copies * parents.size()) {
  const std::vector<int> height = heights(parents);
  std::vector<std::vector<int>> children(parents.size());
  std::priority_queue<Ready> ready;
  for (int i = 0; i < bodies_; ++i) {
    if (parents[i] >= 0) children[parents[i]].push_back(i);
  }
  for (int copy = 0; copy < copies; ++copy) {
    for (int i = 0; i < bodies_; ++i) {
      if (parents[i] < 0) ready.push({height[i], copy, i});
    }
  }
  while (!ready.empty()) {
    const int slot = static_cast<int>(tasks_.size()) / lanes;
    tasks_.resize(tasks_.size() + lanes);
    std::vector<Ready> chosen;
    for (; static_cast<int>(chosen.size()) < lanes && !ready.empty(); ready.pop()) chosen.push_back(ready.top());
    const auto put = [&](const Ready& task, int lane) {
      tasks_[slot * lanes + lane].copy = task.copy;
      tasks_[slot * lanes + lane].body = task.body;
      place_[task.copy * bodies_ + task.body] = slot * lanes + lane;
    };
    // A body takes its parent's lane if it can, so that packs stay aligned.
    std::vector<Ready> rest;
    for (const Ready& task : chosen) {
      const int parent = parents[task.body];
      const int lane = parent < 0 ? task.copy % lanes : lane_of(task.copy, parent);
      tasks_[slot * lanes + lane].copy < 0 ? put(task, lane) : rest.push_back(task);
    }
    for (const Ready& task : rest) {
      int lane = 0;
      while (tasks_[slot * lanes + lane].copy >= 0) ++lane;
      put(task, lane);
    }
    for (const Ready& task : chosen) {
      for (int child : children[task.body]) ready.push({height[child], task.copy, child});
    }
  }
  const int slots = static_cast<int>(tasks_.size()) / lanes;
  for (std::size_t k = 0; k < tasks_.size(); ++k) {
    Task& task = tasks_[k];
    const int parent = task.copy < 0 ? -1 : parents[task.body];
    task.parent_slot = parent < 0 ? slots : slot_of(task.copy, parent);
    task.parent_lane = parent < 0 ? static_cast<int>(k) % lanes : lane_of(task.copy, parent);
  }
  for (int slot = 0; slot < slots; ++slot) {
    const Task* lane = tasks(slot);
    parent_slot_.push_back(std::find_if(lane, lane + lanes, [](const Task& t) { return t.copy >= 0; })->parent_slot);
    aligned_.push_back(is_aligned(slot));
  }
}

bool Schedule::is_aligned(int slot) const {
  const int above = parent_slot_[slot];
  const bool world = above == static_cast<int>(tasks_.size()) / lanes_;
  for (int k = 0; k < lanes_; ++k) {
    const Task& task = tasks(slot)[k];
    const bool idle = task.copy < 0;
    if (!idle && (task.parent_lane != k || task.parent_slot != above)) return false;
    // An idle lane passes on nonsense: harmless only where its parent's lane idles too.
    if (idle && !world && tasks(above)[k].copy >= 0) return false;
  }
  return true;
}

}  // namespace layfigure::dynamics
