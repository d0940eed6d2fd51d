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

TEST(History, Places_AreToldApartAndNeverReused) {
  History history;
  EXPECT_EQ(history.place(), 0);
  history.begin("a", doll(1));
  const std::int64_t a = history.place();
  (void)history.undo(doll(2));
  EXPECT_EQ(history.place(), 0);
  history.begin("b", doll(1));
  EXPECT_GT(history.place(), a);
  EXPECT_TRUE(history.has(a));
  EXPECT_FALSE(history.has(history.place() + 1));
  EXPECT_FALSE(history.has(-1));
}

TEST(History, Go_AcrossBranches_GoesToHowEachPlaceWasLeft) {
  History history;
  history.begin("a", doll(1));
  history.begin("aa", doll(2));
  const std::int64_t aa = history.place();
  (void)history.undo(doll(3));
  (void)history.undo(doll(2));
  history.begin("b", doll(1));
  const std::int64_t b = history.place();
  const std::optional<History::Move> there = history.go(aa, doll(4));
  EXPECT_EQ(number(there), 3);
  EXPECT_EQ(there->label, "aa");
  EXPECT_EQ(history.undoable(), 2u);
  EXPECT_EQ(number(history.go(b, doll(3.5))), 4);
  EXPECT_EQ(number(history.go(aa, doll(4))), 3.5);
  EXPECT_EQ(number(history.go(0, doll(3.5))), 1);
  EXPECT_EQ(history.label(), "");
}

TEST(History, RedoAfterGoingBack_LeadsToWhereOneCameFrom) {
  History history;
  history.begin("a", doll(1));
  const std::int64_t a = history.place();
  history.begin("old", doll(2));
  history.begin("older", doll(3));
  const std::int64_t older = history.place();
  (void)history.go(a, doll(4));
  history.begin("new", doll(2));
  (void)history.go(older, doll(5));
  (void)history.go(0, doll(4));
  EXPECT_EQ(history.redo({})->label, "a");
  EXPECT_EQ(history.redo({})->label, "old");
  EXPECT_EQ(history.redo({})->label, "older");
}

TEST(History, GoToNoPlace_ChangesNothing) {
  History history;
  history.begin("a", doll(1));
  EXPECT_FALSE(history.go(7, doll(9)));
  EXPECT_FALSE(history.go(-1, doll(9)));
  EXPECT_EQ(number(history.undo(doll(2))), 1);
  EXPECT_EQ(number(history.redo({})), 2);
}

TEST(History, ForgottenPlace_CannotBeGoneTo) {
  History history;
  for (std::size_t k = 0; k < History::kMaxSteps; ++k) history.begin("step", doll(0));
  EXPECT_TRUE(history.has(0));
  history.begin("step", doll(0));
  EXPECT_FALSE(history.has(0));
  EXPECT_FALSE(history.go(0, doll(1)));
  EXPECT_TRUE(history.go(1, doll(1)));
  EXPECT_EQ(history.label(), "") << "the root";
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
