#include "schedule.h"

#include <gtest/gtest.h>

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
            if (task.copy < 0) continue;
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

TEST(Schedule, FourCopiesOfAChain_StayInTheirLanes) {
  std::vector<int> parents;
  for (int i = 0; i < 30; ++i) parents.push_back(i - 1);
  const Schedule schedule(parents, 4, 4);
  EXPECT_EQ(schedule.size(), 30);
  for (int slot = 0; slot < schedule.size(); ++slot) EXPECT_TRUE(schedule.aligned(slot));
}

TEST(Schedule, Star_FillsTheLanes) {
  std::vector<int> parents(41, 0);
  parents[0] = -1;
  EXPECT_EQ(Schedule(parents, 1, 4).size(), 11);
}

}  // namespace
}  // namespace layfigure::dynamics
