#include "layfigure/session/history.h"

#include <gtest/gtest.h>

namespace layfigure::session {
namespace {

/// A doll that is told by one number.
haptics::DollMemory doll(double number) {
  haptics::DollMemory memory;
  memory.gravity.x() = number;
  return memory;
}

double number(const std::optional<History::Move>& move) { return move ? move->memory.gravity.x() : -1.0; }

TEST(History, Empty_HasNoWay) {
  History history;
  EXPECT_FALSE(history.undo(doll(1)));
  EXPECT_FALSE(history.redo({}));
  EXPECT_EQ(history.undoable(), 0u);
}

TEST(History, UndoAndRedo_GoToHowThePlaceWasLeft) {
  History history;
  history.begin("a", doll(1));
  history.begin("b", doll(2));
  EXPECT_EQ(number(history.undo(doll(3))), 2);
  EXPECT_EQ(number(history.undo(doll(2.5))), 1);
  EXPECT_EQ(number(history.redo({})), 2.5);
  EXPECT_EQ(number(history.redo({})), 3);
  EXPECT_FALSE(history.redo({}));
}

TEST(History, WhatIsDoneAfterUndo_IsABranchBesideTheOld) {
  History history;
  history.begin("a", doll(1));
  (void)history.undo(doll(2));
  history.begin("b", doll(1));
  (void)history.undo(doll(3));
  EXPECT_EQ(history.branches(), (std::vector<std::string>{"a", "b"}));
  EXPECT_FALSE(history.redo(2));
  EXPECT_EQ(number(history.redo(0)), 2);
  (void)history.undo(doll(2));
  EXPECT_EQ(number(history.redo({})), 2) << "undone last";
}

TEST(History, ManySteps_OldestAreForgotten) {
  History history;
  for (int k = 0; k < 1000; ++k) history.begin("step", doll(k));
  EXPECT_EQ(history.undoable(), History::kMaxSteps);
  double oldest = -1;
  while (history.undoable() > 0) oldest = number(history.undo(doll(0)));
  EXPECT_EQ(oldest, 1000.0 - History::kMaxSteps);
}

TEST(History, ManyBranches_OldestIsForgottenFirst) {
  History history;
  for (std::size_t k = 0; k < 2 * History::kMaxSteps; ++k) {
    history.begin(std::to_string(k), doll(0));
    (void)history.undo(doll(1));
  }
  EXPECT_EQ(history.branches().size(), History::kMaxSteps);
  EXPECT_EQ(history.branches().back(), std::to_string(2 * History::kMaxSteps - 1));
  EXPECT_TRUE(history.redo({}));
}

}  // namespace
}  // namespace layfigure::session
