#include "schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace layfigure::dynamics {
namespace {

std::vector<int> random_tree(int size, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<int> parents{-1};
  for (int i = 1; i < size; ++i) {
    // Mostly chains, sometimes a branch, now and then another root.
    const int kind = static_cast<int>(random() % 10);
    parents.push_back(kind == 0 ? -1 : kind < 4 ? static_cast<int>(random() % i) : i - 1);
  }
  return parents;
}

TEST(Schedule, RandomTrees_EveryTaskOnceAfterItsParent) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const auto parents = random_tree(1 + seed * 3, seed);
    for (const int copies : {1, 2, 3, 4}) {
      for (const int lanes : {1, 4}) {
        const Schedule schedule(parents, copies, lanes);
        std::set<std::pair<int, int>> seen;
        for (int slot = 0; slot < schedule.size(); ++slot) {
          for (int lane = 0; lane < lanes; ++lane) {
            const Task& task = schedule.tasks(slot)[lane];
            if (task.idle) continue;
            EXPECT_TRUE(seen.insert({task.copy, task.body}).second);
            EXPECT_EQ(schedule.slot_of(task.copy, task.body), slot);
            EXPECT_EQ(schedule.lane_of(task.copy, task.body), lane);
            const int parent = parents[task.body];
            if (parent < 0) {
              EXPECT_EQ(task.parent_slot, schedule.size());
            } else {
              EXPECT_LT(task.parent_slot, slot);
              EXPECT_EQ(schedule.tasks(task.parent_slot)[task.parent_lane].body, parent);
              EXPECT_EQ(schedule.tasks(task.parent_slot)[task.parent_lane].copy, task.copy);
            }
          }
        }
        EXPECT_EQ(seen.size(), parents.size() * copies);
      }
    }
  }
}

TEST(Schedule, RandomTrees_ChildrenInTreeOrderAndWholeWhereTheirLanesAgree) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    const auto parents = random_tree(1 + seed * 3, seed);
    for (const int copies : {1, 3, 4}) {
      constexpr int kLanes = 4;
      const Schedule schedule(parents, copies, kLanes);
      for (int slot = 0; slot < schedule.size(); ++slot) {
        for (int lane = 0; lane < kLanes; ++lane) {
          const Task& task = schedule.tasks(slot)[lane];
          int last = -1;
          for (const int place : schedule.children(slot, lane)) {
            const Task& child = schedule.tasks(place / kLanes)[place % kLanes];
            EXPECT_EQ(child.copy, task.copy);
            EXPECT_EQ(parents[child.body], task.body);
            EXPECT_GT(child.body, last);
            last = child.body;
            EXPECT_EQ(schedule.passed_whole(place / kLanes), schedule.adds_whole(slot));
            if (!schedule.adds_whole(slot)) continue;
            EXPECT_EQ(place % kLanes, lane);
            EXPECT_TRUE(schedule.aligned(place / kLanes));
          }
          const auto is_child = [&](int parent) { return parent == task.body; };
          const auto count = std::count_if(parents.begin(), parents.end(), is_child);
          EXPECT_EQ(schedule.children(slot, lane).size(), task.idle ? 0U : static_cast<std::size_t>(count));
          EXPECT_TRUE(schedule.aligned(slot) || schedule.read_by_lane(task.parent_slot));
        }
      }
    }
  }
}

TEST(Schedule, FourCopiesOfABranchedTree_StayInTheirLanes) {
  const Schedule schedule({-1, 0, 1, 0, 3, 4, 0, 6}, 4, 4);
  EXPECT_EQ(schedule.size(), 8);
  for (int slot = 0; slot < schedule.size(); ++slot) EXPECT_TRUE(schedule.aligned(slot));
}

TEST(Schedule, FourCopiesOfAChain_StayInTheirLanes) {
  std::vector<int> parents;
  for (int i = 0; i < 30; ++i) parents.push_back(i - 1);
  const Schedule schedule(parents, 4, 4);
  EXPECT_EQ(schedule.size(), 30);
  for (int slot = 0; slot < schedule.size(); ++slot) {
    EXPECT_TRUE(schedule.aligned(slot));
    EXPECT_TRUE(schedule.adds_whole(slot));
  }
}

TEST(Schedule, Star_FillsTheLanes) {
  std::vector<int> parents(41, 0);
  parents[0] = -1;
  EXPECT_EQ(Schedule(parents, 1, 4).size(), 11);
}

}  // namespace
}  // namespace layfigure::dynamics
