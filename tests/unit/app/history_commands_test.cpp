// Undo, redo and the tree of what was done to a doll.
#include <gtest/gtest.h>

#include "edit_commands_fixture.h"

namespace layfigure::app {
namespace {

TEST_F(EditCommands, Undo_AfterGesture_PutsTheDollBackBitForBit) {
  steps(2000);
  const std::string before = memory();
  lift(0.3);
  ASSERT_NE(memory(), before);
  const reply_t reply = send("undo");
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(memory(), before);
  EXPECT_EQ(text(reply, "label"), "grab arm");
  EXPECT_EQ(result(reply, "steps"), std::vector<double>{0.0});
  EXPECT_EQ(result(reply, "branches"), std::vector<double>{1.0});
  for (const dynamics::BodyState& body : simulation_.state().bodies) {
    EXPECT_TRUE(body.linear_momentum.isZero(0.0) && body.angular_momentum.isZero(0.0));
  }
}

TEST_F(EditCommands, Undo_WhatWasAtRest_StaysThere) {
  steps(3000);
  const Eigen::Quaterniond before = simulation_.state().bodies[kArm].rotation;
  lift(0.3);
  send("undo");
  steps(1000);
  EXPECT_LT(simulation_.state().bodies[kArm].rotation.angularDistance(before), 1e-3);
}

TEST_F(EditCommands, Redo_AfterUndo_BringsTheGestureBackBitForBit) {
  lift(0.3);
  const std::string after = memory();
  send("undo");
  const reply_t reply = send("redo");
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(memory(), after);
  EXPECT_EQ(text(reply, "label"), "grab arm");
  EXPECT_FALSE(send("redo").accepted);
}

TEST_F(EditCommands, GestureAfterUndo_OldBranch_IsKeptAndCanBeChosen) {
  lift(0.3);
  const std::string first = memory();
  send("undo");
  lift(-0.3);
  const std::string second = memory();
  ASSERT_NE(first, second);
  EXPECT_EQ(result(send("undo"), "branches"), std::vector<double>{2.0});
  send("redo", {number_argument("branch", {0.0})});
  EXPECT_EQ(memory(), first);
  send("undo");
  send("redo", {number_argument("branch", {1.0})});
  EXPECT_EQ(memory(), second);
  send("undo");
  send("redo");
  EXPECT_EQ(memory(), second) << "the branch that was undone last";
}

TEST_F(EditCommands, Undo_WhileHeld_ReleasesAndSaysSo) {
  const std::string before = memory();
  const reply_t held = send("grab", {text_argument("bone", "arm"), number_argument("pointer", {3.0})});
  steps(100);
  const reply_t reply = send("undo");
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(result(reply, "released"), std::vector<double>{3.0});
  EXPECT_TRUE(simulation_.hands().busy_pointers().empty());
  EXPECT_EQ(memory(), before);
}

TEST_F(EditCommands, TwoHandsThatTakeHoldTogether_AreOneStep) {
  const std::string before = memory();
  send("grab", {text_argument("bone", "arm"), number_argument("pointer", {0.0})});
  steps(100);
  send("grab", {text_argument("bone", "spine"), number_argument("pointer", {1.0})});
  steps(100);
  EXPECT_EQ(result(send("undo"), "released"), (std::vector<double>{0.0, 1.0}));
  EXPECT_EQ(memory(), before);
  EXPECT_EQ(simulation_.history().undoable(), 0u);
}

TEST_F(EditCommands, SecondHandThatComesLater_IsAStepOfItsOwn) {
  send("grab", {text_argument("bone", "arm"), number_argument("pointer", {0.0})});
  steps(1000);
  send("grab", {text_argument("bone", "spine"), number_argument("pointer", {1.0})});
  EXPECT_EQ(simulation_.history().undoable(), 2u);
}

TEST_F(EditCommands, Undo_AfterTwoQuickSeparateGrabs_UndoesTheSecondAlone) {
  steps(2000);
  const std::string before = memory();
  std::string between;
  for (int grab = 0; grab < 2; ++grab) {
    between = memory();
    const std::vector<double> at = result(send("grab", {text_argument("bone", "arm")}), "position");
    point(++pointed_, {at[0], at[1], at[2] + 0.2});
    steps(50);
    ASSERT_TRUE(send("release").accepted);
    steps(10);
  }
  ASSERT_NE(between, before);
  EXPECT_EQ(simulation_.history().undoable(), 2u);
  ASSERT_TRUE(send("undo").accepted);
  EXPECT_EQ(memory(), between);
  ASSERT_TRUE(send("undo").accepted);
  EXPECT_EQ(memory(), before);
}

TEST_F(EditCommands, Undo_OfEachEditingCommand_RestoresTheDoll) {
  lift(0.3);
  const std::vector<std::pair<std::string, std::vector<argument_t>>> edits{
      {"pin", {text_argument("bone", "arm")}},
      {"set", {text_argument("bone", "arm"), number_argument("stiffness.factor", {3.0})}},
      {"set", {number_argument("softness", {0.25})}},
      {"set", {number_argument("gravity", {0.0, 0.0, -1.0})}},
      {"set", {text_argument("bone", "a*"), number_argument("limits.twist", {-0.5, 0.5})}},
      {"lock", {text_argument("bone", "arm")}},
      {"reset", {}},
      {"reset", {number_argument("all", {1.0})}}};
  for (const auto& [name, arguments] : edits) {
    const std::string before = memory();
    const reply_t reply = send(name, arguments);
    ASSERT_TRUE(reply.accepted) << name << ": " << reply.reason;
    EXPECT_NE(memory(), before) << name;
    steps(50);
    ASSERT_TRUE(send("undo").accepted) << name;
    EXPECT_EQ(memory(), before) << name;
  }
}

TEST_F(EditCommands, Undo_AfterFailure_GoesOn) {
  const std::string before = memory();
  send("grab", {text_argument("bone", "arm")});
  point(++pointed_, {1e300, 0.0, 0.0});
  send("step", {number_argument("count", {1000.0})});
  if (simulation_.failure().empty()) GTEST_SKIP() << "the pull was not strong enough to fail";
  ASSERT_TRUE(send("undo").accepted);
  EXPECT_EQ(memory(), before);
  steps(10);
}

TEST_F(EditCommands, SetsOfOneSlider_AreOneStep) {
  for (int k = 1; k <= 30; ++k) {
    send("set", {text_argument("bone", "arm"), number_argument("stiffness", {10.0 * k})});
    steps(16);
  }
  EXPECT_EQ(simulation_.history().undoable(), 1u);
  send("undo");
  EXPECT_EQ(law(kArm).stiffness, 40.0);
}

TEST_F(EditCommands, NothingToUndoOrRedo_Refused) {
  EXPECT_EQ(send("undo").reason, "there is nothing to undo");
  EXPECT_EQ(send("redo").reason, "there is nothing to do again");
}

TEST_F(EditCommands, HistoryState_TellsWhereTheDollIs) {
  const std::string before = fingerprint();
  reply_t reply = send("history");
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(text(reply, "label"), "");
  EXPECT_EQ(result(reply, "place"), std::vector<double>{0.0});
  EXPECT_EQ(result(reply, "steps"), std::vector<double>{0.0});
  EXPECT_EQ(result(reply, "branches"), std::vector<double>{0.0});
  EXPECT_EQ(fingerprint(), before);
  send("lock", {text_argument("bone", "arm")});
  reply = send("history", {text_argument("action", "state")});
  EXPECT_EQ(text(reply, "label"), "lock arm");
  EXPECT_GT(result(reply, "place")[0], 0.0);
  EXPECT_EQ(result(reply, "steps"), std::vector<double>{1.0});
  EXPECT_EQ(result(send("undo"), "place"), std::vector<double>{0.0});
}

TEST_F(EditCommands, HistoryGo_AcrossBranches_BringsEachPlaceBackBitForBit) {
  steps(2000);
  std::vector<std::pair<double, std::string>> places;
  const auto note_place = [&] { places.emplace_back(result(send("history"), "place")[0], memory()); };
  note_place();
  lift(0.3);
  note_place();
  send("pin", {text_argument("bone", "spine")});
  note_place();
  send("undo");
  send("undo");
  lift(-0.3);
  note_place();
  for (const std::size_t k : {2u, 3u, 1u, 3u, 0u, 2u, 0u}) {
    const reply_t reply = send("history", {text_argument("action", "go"), number_argument("place", {places[k].first})});
    ASSERT_TRUE(reply.accepted) << reply.reason;
    EXPECT_EQ(result(reply, "place"), std::vector<double>{places[k].first});
    EXPECT_EQ(memory(), places[k].second) << k;
  }
}

TEST_F(EditCommands, HistoryGo_WhileHeld_ReleasesAndSaysSo) {
  steps(10);
  const std::string before = memory();
  send("grab", {text_argument("bone", "arm"), number_argument("pointer", {3.0})});
  steps(100);
  const reply_t reply = send("history", {text_argument("action", "go"), number_argument("place", {0.0})});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(result(reply, "released"), std::vector<double>{3.0});
  EXPECT_EQ(memory(), before);
}

TEST_F(EditCommands, HistoryGo_ToWhereTheDollIs_LeavesItInItsHands) {
  send("grab", {text_argument("bone", "arm")});
  steps(100);
  const std::string before = fingerprint();
  const double place = result(send("history"), "place")[0];
  const reply_t reply = send("history", {text_argument("action", "go"), number_argument("place", {place})});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(text(reply, "label"), "grab arm");
  EXPECT_TRUE(result(reply, "released").empty());
  EXPECT_EQ(fingerprint(), before);
}

TEST_F(EditCommands, HistoryGo_ToNoPlace_RefusedWithItsNumber) {
  const reply_t reply = send("history", {text_argument("action", "go"), number_argument("place", {42.0})});
  EXPECT_EQ(reply.reason, "the history has no place 42: there never was one, or it is forgotten");
}

}  // namespace
}  // namespace layfigure::app
