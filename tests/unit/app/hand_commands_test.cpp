// Grabs, touches, pins, and what `set` does to a hand.
#include <gtest/gtest.h>

#include <limits>
#include <utility>

#include "commands_fixture.h"

namespace layfigure::app {
namespace {

TEST_F(Commands, Grab_AnswersWhatIsHeld) {
  const reply_t reply = send("grab", {text_argument("bone", "arm"), number_argument("point", {0.1, 0, 0})});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(result(reply, "joint"), (std::vector<double>{2}));
  ASSERT_EQ(result(reply, "position").size(), 3U);
  EXPECT_NEAR(result(reply, "position")[0], 0.5, 1e-12);
  EXPECT_GT(result(reply, "stiffness")[0], 0.0);
  EXPECT_GT(result(reply, "damping")[0], 0.0);
}

TEST_F(Commands, GrabWithGains_TakesThem) {
  const reply_t reply =
      send("grab", {text_argument("bone", "arm"), number_argument("stiffness", {500}), number_argument("damping", {7}),
                    text_argument("mode", "6dof"), number_argument("pointer", {3})});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  const dynamics::Coupling& coupling = simulation_.pointers().at(3).grip()->coupling;
  EXPECT_EQ(coupling.stiffness, 500.0);
  EXPECT_EQ(coupling.damping, 7.0);
  EXPECT_GT(coupling.angular_stiffness, 0.0);
}

TEST_F(Commands, BadGrab_RefusedAndNothingHeld) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<std::vector<argument_t>, std::string>> cases{
      {{}, "bone"},
      {{text_argument("bone", "tail")}, "tail"},
      {{number_argument("bone", {2})}, "bone"},
      {{text_argument("bone", "arm"), number_argument("pointer", {16})}, "pointer"},
      {{text_argument("bone", "arm"), number_argument("pointer", {0.5})}, "pointer"},
      {{text_argument("bone", "arm"), number_argument("point", {1, 2})}, "point"},
      {{text_argument("bone", "arm"), number_argument("point", {1, 2, nan})}, "point"},
      {{text_argument("bone", "arm"), number_argument("stiffness", {-1})}, "stiffness"},
      {{text_argument("bone", "arm"), number_argument("stiffness", {nan})}, "stiffness"},
      {{text_argument("bone", "arm"), number_argument("damping", {1e10})}, "damping"},
      {{text_argument("bone", "arm"), text_argument("mode", "2dof")}, "2dof"},
      {{text_argument("bone", "arm"), number_argument("angular_stiffness", {1})}, "needs mode 6dof"},
  };
  for (const auto& [arguments, word] : cases) {
    const reply_t reply = send("grab", arguments);
    EXPECT_FALSE(reply.accepted) << word;
    EXPECT_NE(reply.reason.find(word), std::string::npos) << reply.reason;
    EXPECT_TRUE(simulation_.pointers().empty()) << word;
  }
}

TEST_F(Commands, Release_LetsGoOnce) {
  send("grab", {text_argument("bone", "arm")});
  EXPECT_TRUE(send("release").accepted);
  EXPECT_EQ(send("release").reason, "pointer 0 holds nothing");
}

TEST_F(Commands, GrabWithoutBone_TakesTheSkinNearThePointer) {
  point(1, {0.59, 0.005, 1.01});
  const reply_t reply = send("grab", {number_argument("reach", {0.02})});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_NEAR(result(reply, "distance").at(0), 0.01, 1e-12);
  EXPECT_NEAR(result(reply, "position").at(2), 1.0, 1e-12);
  EXPECT_NEAR(result(reply, "point").at(1), 0.005, 1e-12);
  EXPECT_EQ(result(reply, "joint").size(), 1U);
}

TEST_F(Commands, GrabByRay_TakesTheSkinThatItMeets) {
  const reply_t reply =
      send("grab", {number_argument("origin", {0.1, 0.005, 3}), number_argument("direction", {0, 0, -1})});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_NEAR(result(reply, "distance").at(0), 2.0, 1e-12);
}

TEST_F(Commands, Grab_AnswersWhereThePointerIs) {
  const reply_t first = send("grab", {text_argument("bone", "arm")});
  std::vector<double> there = result(first, "position");
  there.insert(there.end(), {1, 0, 0, 0});
  EXPECT_EQ(result(first, "pointer"), there) << "without a pose of its own it is at the held point";
  send("release");
  point(1, {0.1, 0.2, 0.3});
  const reply_t second = send("grab", {text_argument("bone", "arm")});
  EXPECT_EQ(result(second, "pointer"), (std::vector<double>{0.1, 0.2, 0.3, 1, 0, 0, 0}));
}

TEST_F(Commands, BadGrabOfWhatIsThere_RefusedAndNothingHeld) {
  point(1, {0.3, 0, 1.2});
  const std::vector<std::pair<std::vector<argument_t>, std::string>> cases{
      {{}, "from the skin"},
      {{number_argument("pointer", {4})}, "no pose yet"},
      {{number_argument("reach", {-1})}, "reach"},
      {{number_argument("point", {0, 0, 0})}, "needs the argument 'bone'"},
      {{text_argument("bone", "arm"), number_argument("reach", {1})}, "without 'bone'"},
      {{number_argument("origin", {0, 0, 3})}, "direction"},
      {{number_argument("origin", {0, 0, 3}), number_argument("direction", {0, 0, 0})}, "is zero"},
      {{number_argument("origin", {0.1, 0, 3}), number_argument("direction", {0, 0, 1})}, "meets no skin"},
      {{number_argument("origin", {0.1, 0, 3}), number_argument("direction", {0, 0, -1}),
        number_argument("reach", {1})},
       "does not go with a ray"},
  };
  for (const auto& [arguments, word] : cases) {
    const reply_t reply = send("grab", arguments);
    EXPECT_FALSE(reply.accepted) << word;
    EXPECT_NE(reply.reason.find(word), std::string::npos) << reply.reason;
    EXPECT_EQ(simulation_.pointers().at(0).tool(), haptics::Tool::kNone) << word;
  }
}

TEST_F(Commands, Touch_BringsTheFingertipOutAndReleasePutsItAway) {
  EXPECT_NE(send("touch").reason.find("no pose yet"), std::string::npos);
  point(1, {0.5, 0.3, 1});
  for (const auto& [arguments, word] : std::vector<std::pair<std::vector<argument_t>, std::string>>{
           {{number_argument("radius", {0})}, "radius"},
           {{number_argument("friction", {-1})}, "friction"},
           {{number_argument("magnet", {2})}, "magnet"},
           {{number_argument("stiffness", {1e300})}, "stiffness"},
           {{text_argument("bone", "arm")}, "bone"}}) {
    const reply_t reply = send("touch", arguments);
    EXPECT_NE(reply.reason.find(word), std::string::npos) << reply.reason;
  }
  EXPECT_EQ(simulation_.state().bodies.size(), 3U);
  const reply_t reply = send("touch", {number_argument("radius", {0.01}), number_argument("magnet", {1})});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(result(reply, "radius"), (std::vector<double>{0.01}));
  EXPECT_EQ(simulation_.state().bodies.size(), 4U);
  send("step", {number_argument("count", {100})});
  const force_t& force = sink_.forces.back();
  EXPECT_EQ(force.tool, "touch");
  EXPECT_TRUE(force.attached);
  EXPECT_FALSE(force.contact);
  EXPECT_EQ(force.joint, -1);
  EXPECT_EQ(sink_.poses.back().joint_count, 4) << "the doll's alone";
  EXPECT_TRUE(send("release").accepted);
  EXPECT_EQ(simulation_.state().bodies.size(), 3U);
}

TEST_F(Commands, Pin_AnswersItsNumberForUnpin) {
  const reply_t reply = send("pin", {text_argument("bone", "tip"), text_argument("mode", "6dof")});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(result(reply, "joint"), (std::vector<double>{3}));
  EXPECT_NEAR(result(reply, "position").at(0), 0.6, 1e-12);
  const double id = result(reply, "pin").at(0);
  EXPECT_TRUE(send("pin", {text_argument("bone", "arm"), text_argument("hold", "rigid")}).accepted);
  for (const auto& [arguments, word] : std::vector<std::pair<std::vector<argument_t>, std::string>>{
           {{}, "needs the argument 'bone'"},
           {{text_argument("bone", "tail")}, "tail"},
           {{text_argument("bone", "arm"), text_argument("hold", "loose")}, "loose"},
           {{text_argument("bone", "arm"), number_argument("point", {0})}, "point"}}) {
    EXPECT_NE(send("pin", arguments).reason.find(word), std::string::npos) << word;
  }
  EXPECT_EQ(simulation_.hands().pins().all().size(), 2U);
  EXPECT_EQ(send("unpin", {number_argument("pin", {77})}).reason, "there is no pin 77");
  EXPECT_FALSE(send("unpin", {number_argument("pin", {0.5})}).accepted);
  EXPECT_TRUE(send("unpin", {number_argument("pin", {id})}).accepted);
  EXPECT_EQ(simulation_.hands().pins().all().size(), 1U);
  EXPECT_TRUE(send("unpin").accepted);
  EXPECT_TRUE(simulation_.hands().pins().all().empty());
}

TEST_F(Commands, PinList_TellsAllPinsInTheirOrder) {
  EXPECT_TRUE(result(send("pin", {text_argument("action", "list")}), "pin").empty());
  const reply_t tip = send("pin", {text_argument("bone", "tip")});
  const reply_t arm = send("pin", {text_argument("bone", "arm"), number_argument("point", {0.1, 0, 0})});
  const reply_t listed = send("pin", {text_argument("action", "list")});
  ASSERT_TRUE(listed.accepted) << listed.reason;
  for (const char* name : {"pin", "joint", "position"}) {
    std::vector<double> both = result(tip, name);
    const std::vector<double> second = result(arm, name);
    both.insert(both.end(), second.begin(), second.end());
    EXPECT_EQ(result(listed, name), both) << name;
  }
  EXPECT_EQ(send("pin", {text_argument("action", "list"), text_argument("bone", "arm")}).reason,
            "argument 'bone' does not go with list");
  EXPECT_FALSE(send("pin", {text_argument("action", "drop"), text_argument("bone", "arm")}).accepted);
  EXPECT_EQ(simulation_.hands().pins().all().size(), 2U);
}

TEST_F(Commands, SetMode_OfAGrabOnly) {
  EXPECT_EQ(send("set", {text_argument("mode", "6dof")}).reason, "pointer 0 holds no bone; grab first");
  send("grab", {text_argument("bone", "arm")});
  EXPECT_TRUE(send("set", {text_argument("mode", "6dof")}).accepted);
  EXPECT_GT(simulation_.pointers().at(0).grip()->coupling.angular_stiffness, 0.0);
  EXPECT_FALSE(send("set", {text_argument("mode", "7dof")}).accepted);
  const dynamics::Coupling& coupling = simulation_.pointers().at(0).grip()->coupling;
  EXPECT_TRUE(send("set", {text_argument("mode", "6dof"), number_argument("angular_stiffness", {2.5})}).accepted);
  EXPECT_EQ(coupling.angular_stiffness, 2.5);
  EXPECT_NEAR(coupling.angular_damping / 2.5, coupling.damping / coupling.stiffness, 1e-12);
  EXPECT_EQ(send("set", {number_argument("angular_stiffness", {2.5})}).reason,
            "argument 'angular_stiffness' needs mode 6dof");
  EXPECT_FALSE(send("set", {text_argument("mode", "6dof"), number_argument("angular_stiffness", {0})}).accepted);
  EXPECT_EQ(coupling.angular_stiffness, 2.5);
  EXPECT_TRUE(send("set", {text_argument("mode", "3dof")}).accepted);
  EXPECT_EQ(coupling.angular_stiffness, 0.0);
  send("release");
  const std::vector<argument_t> stiff{text_argument("bone", "arm"), text_argument("mode", "6dof"),
                                      number_argument("angular_stiffness", {4})};
  EXPECT_TRUE(send("grab", stiff).accepted);
  EXPECT_EQ(simulation_.pointers().at(0).grip()->coupling.angular_stiffness, 4.0);
}

TEST_F(Commands, Set_ChangesAllOrNothing) {
  point(1, {0.1, 0, 0});
  EXPECT_TRUE(send("set", {number_argument("scale", {2}), number_argument("softness", {0.5})}).accepted);
  EXPECT_EQ(simulation_.pointers().at(0).map().scale(), 2.0);
  EXPECT_EQ(simulation_.hands().softness().factor(2), 0.5);
  EXPECT_TRUE(send("set", {number_argument("softness", {0.25}), text_argument("bone", "arm")}).accepted);
  EXPECT_EQ(simulation_.hands().softness().factor(2), 0.25);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [arguments, word] : std::vector<std::pair<std::vector<argument_t>, std::string>>{
           {{}, "something to set"},
           {{number_argument("pointer", {1})}, "something to set"},
           {{number_argument("scale", {0})}, "scale"},
           {{number_argument("scale", {nan})}, "scale"},
           {{number_argument("clutch", {0.5})}, "clutch"},
           {{number_argument("base", {0, 0, 0, 2, 0, 0, 0})}, "unit quaternion"},
           {{number_argument("base", {0, 0, 0})}, "base"},
           {{number_argument("base", {0, 0, nan, 1, 0, 0, 0})}, "base"},
           {{number_argument("softness", {-0.1})}, "softness"},
           {{number_argument("softness", {0.1}), number_argument("pointer", {0})}, "pointer"},
           {{number_argument("scale", {3}), text_argument("bone", "arm")}, "something to set of its joint"},
           {{number_argument("scale", {3}), number_argument("softness", {0.1}), text_argument("bone", "hips")},
            "joint"},
           {{number_argument("scale", {3}), number_argument("magnet", {1})}, "no fingertip"}}) {
    const reply_t reply = send("set", arguments);
    EXPECT_FALSE(reply.accepted) << word;
    EXPECT_NE(reply.reason.find(word), std::string::npos) << reply.reason;
    EXPECT_EQ(simulation_.pointers().at(0).map().scale(), 2.0) << word;
    EXPECT_EQ(simulation_.hands().softness().factor(2), 0.25) << word;
  }
}

TEST_F(Commands, SetOfAPointer_ReachesItsForceMessage) {
  point(1, {0.6, 0, 1});
  send("set", {number_argument("base", {0, 0, 1, 1, 0, 0, 0}), number_argument("scale", {0.5})});
  send("grab", {text_argument("bone", "tip")});
  send("step", {number_argument("count", {500})});
  const force_t force = sink_.forces.back();
  EXPECT_EQ(force.tool, "grab");
  EXPECT_TRUE(force.contact);
  ASSERT_GT(std::abs(force.force[2]), 1e-3);
  EXPECT_EQ(force.hand_force[2], -0.5 * force.force[2]);
  EXPECT_NE(send("set", {number_argument("base", {0, 0, 0, 1, 0, 0, 0})}).reason.find("release it first"),
            std::string::npos);
  send("set", {number_argument("clutch", {1})});
  send("step", {number_argument("count", {100})});
  EXPECT_EQ(sink_.forces.back().hand_force[2], 0.0);
}

}  // namespace
}  // namespace layfigure::app
