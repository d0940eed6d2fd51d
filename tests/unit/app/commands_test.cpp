#include "layfigure/app/commands.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <utility>

#include "commands_fixture.h"

namespace layfigure::app {
namespace {

constexpr int kManySteps = 10000;

/// Pulls the arm that far away, evenly over many steps.
void pull_away(Simulation& simulation, double distance) {
  simulation.grab({.pointer = 0, .bone = 2});
  simulation.point(0, {{distance, 0.0, 0.0}, Eigen::Quaterniond::Identity()}, "test", 1);
  simulation.begin_motion(kManySteps);
}

bool first_step_is_finite(double distance) {
  Simulation simulation(testing::small_doll(), {.clock = ClockKind::kLockstep});
  pull_away(simulation, distance);
  return simulation.advance();
}

/// The farthest that the first step is finite for, to a factor of two. The arm stays behind what pulls it by more in
/// each step, so that a later one is not.
double doomed_distance() {
  double distance = 1e100;
  while (first_step_is_finite(2.0 * distance)) distance *= 2.0;
  return distance;
}

TEST_F(Commands, Unknown_RefusedByName) { EXPECT_EQ(send("dance").reason, "unknown command 'dance'"); }

TEST_F(Commands, OtherProtocolVersion_RefusedNamingBoth) {
  command_t command = make_command(1, "key");
  command.protocol_version = 2;
  EXPECT_EQ(handle(command).reason, "protocol version 2, this server speaks 1");
}

TEST_F(Commands, UnknownArgument_RefusedByEachCommand) {
  for (const char* name : {"grab", "touch", "release", "pin", "unpin", "set", "key", "reset", "step", "get_character",
                           "get_joints", "get_mesh", "shutdown"}) {
    const reply_t reply = send(name, {number_argument("colour", {1.0})});
    EXPECT_EQ(reply.reason, std::string(name) + " has no argument 'colour'");
  }
  EXPECT_EQ(simulation_.steps(), 0);
  EXPECT_FALSE(processor_.shutdown_requested());
}

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

TEST_F(Commands, Step_AdvancesAndPublishesPosesBeforeTheReply) {
  const reply_t reply = send("step", {number_argument("count", {100})});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(simulation_.steps(), 100);
  EXPECT_EQ(sink_.poses.size(), 7U);
  EXPECT_EQ(reply.time_us, 100000);
  EXPECT_EQ(result(reply, "steps"), (std::vector<double>{100}));
  EXPECT_TRUE(send("step").accepted);
  EXPECT_EQ(simulation_.steps(), 101);
}

TEST_F(Commands, BadStep_RefusedAndTimeStandsStill) {
  for (const double count : {0.0, -1.0, 1.5, 10001.0, std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(send("step", {number_argument("count", {count})}).accepted) << count;
  }
  EXPECT_FALSE(send("step", {number_argument("pointer_sequence", {0})}).accepted);
  EXPECT_FALSE(send("step", {number_argument("pointer_sequence", {0, -1})}).accepted);
  EXPECT_FALSE(send("step", {number_argument("pointer_sequence", {4294967296.0, 1})}).accepted);
  EXPECT_EQ(simulation_.steps(), 0);
}

TEST_F(Commands, StepBeforeItsPointerMessage_RefusedUntilItComes) {
  point(11, {0, 0, 0});
  EXPECT_EQ(send("step", {number_argument("pointer_sequence", {0, 12})}).reason,
            "pointer 0: message 12 has not arrived; send it again");
  point(12, {0, 0, 0}, "another");
  EXPECT_FALSE(send("step", {number_argument("pointer_sequence", {0, 12})}).accepted);
  point(12, {0, 0, 0});
  EXPECT_TRUE(send("step", {number_argument("pointer_sequence", {0, 12})}).accepted);
  EXPECT_FALSE(send("step", {number_argument("pointer_sequence", {0, 12, 1, 1})}).accepted);
  EXPECT_EQ(simulation_.steps(), 1);
}

TEST_F(Commands, StepWhosePointerAnotherClientHasMoved_RefusedNamingThatClient) {
  point(1, {0, 0, 0.1});
  point(7, {0, 0, 0.2}, "other");
  const auto step = [this] { return send("step", {number_argument("pointer_sequence", {0.0, 1.0})}); };
  const reply_t refused = step();
  EXPECT_FALSE(refused.accepted);
  EXPECT_NE(refused.reason.find("client 'other' has moved the pointer since"), std::string::npos) << refused.reason;
  point(1, {0, 0, 0.1});
  EXPECT_TRUE(step().accepted) << "the one that came last wins";
}

TEST_F(Commands, RegrabWithinOneStep_HoldsAnewFromWhereItIs) {
  const auto grab = [this](const std::string& bone) { return send("grab", {text_argument("bone", bone)}); };
  const std::vector<double> held = result(grab("arm"), "position");
  point(1, {held[0], held[1], held[2] + 0.2});
  ASSERT_TRUE(send("step", {number_argument("count", {3000.0})}).accepted);  // until the arm stands still
  const auto pull = [this] { return simulation_.pointers().at(0).force_on_hand().force.norm(); };
  const double first_pull = pull();
  ASSERT_GT(first_pull, 1.0);
  const dynamics::State before = simulation_.state();
  for (const char* bone : {"arm", "spine", "arm"}) {
    ASSERT_TRUE(send("release").accepted);
    const reply_t again = grab(bone);
    ASSERT_TRUE(again.accepted) << again.reason;
  }
  for (std::size_t body = 0; body < before.bodies.size(); ++body) {
    EXPECT_EQ(simulation_.state().bodies[body].linear_momentum, before.bodies[body].linear_momentum) << body;
    EXPECT_EQ(simulation_.state().bodies[body].rotation.coeffs(), before.bodies[body].rotation.coeffs()) << body;
  }
  ASSERT_TRUE(send("step").accepted);
  EXPECT_LT(pull(), 0.05 * first_pull) << "the first grip's pull is gone with it";
  EXPECT_EQ(simulation_.hands().busy_pointers(), std::vector<int>{0});
  ASSERT_TRUE(send("release").accepted);
  EXPECT_FALSE(send("release").accepted) << "one release for each grab, and none left over";
}

TEST_F(Commands, TwoClientsInterleavedWithEqualSequences_EachCarriedOutOnceAndAnsweredForItself) {
  constexpr int kEach = 20;
  const auto command_of = [](const std::string& client, int sequence) {
    command_t command = make_command(sequence, "step");
    command.client_id = client;
    add_argument(command, number_argument("count", {client == "a" ? 1.0 : 2.0}));
    return command;
  };
  std::vector<reply_t> first;
  for (int sequence = 1; sequence <= kEach; ++sequence) {
    for (const char* client : {"a", "b"}) first.push_back(handle(command_of(client, sequence)));
  }
  EXPECT_EQ(simulation_.steps(), 3 * kEach);
  std::size_t k = 0;
  for (int sequence = 1; sequence <= kEach; ++sequence) {
    for (const char* client : {"a", "b"}) {
      const reply_t again = handle(command_of(client, sequence));
      EXPECT_EQ(messaging::encode(again), messaging::encode(first[k])) << client << sequence;
      EXPECT_EQ(result(again, "steps"), std::vector<double>{3.0 * sequence - (client == std::string("a") ? 2.0 : 0.0)});
      ++k;
    }
  }
  EXPECT_EQ(simulation_.steps(), 3 * kEach);
}

TEST_F(Commands, StepWithAGrip_GlidesOverItsWholeCount) {
  send("grab", {text_argument("bone", "tip")});
  point(1, {0.6, 0, 1.5});
  send("step", {number_argument("count", {50})});
  EXPECT_EQ(simulation_.pointers().at(0).pose().position, Eigen::Vector3d(0.6, 0, 1.5));
  const force_t& force = sink_.forces.back();
  EXPECT_NEAR(force.target[2], 1.5, 1e-12);
}

TEST_F(RealtimeCommands, Step_RefusedNamingTheClock) {
  EXPECT_NE(send("step").reason.find("lockstep"), std::string::npos);
  EXPECT_EQ(simulation_.steps(), 0);
}

TEST_F(Commands, StepThatFails_SaysHowFarItCameThenRefusesUntilReset) {
  pull_away(simulation_, doomed_distance());
  const reply_t reply = send("step", {number_argument("count", {kManySteps})});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_GT(simulation_.steps(), 0);
  EXPECT_EQ(result(reply, "steps"), (std::vector<double>{static_cast<double>(simulation_.steps())}));
  EXPECT_LT(simulation_.steps(), kManySteps);
  EXPECT_EQ(send("step").reason, simulation_.failure());
  EXPECT_TRUE(send("key").accepted);
  EXPECT_TRUE(send("reset").accepted);
  EXPECT_TRUE(send("step").accepted);
}

TEST_F(Commands, Repeated_AnsweredAgainAndNotCarriedOutAgain) {
  command_t command = make_command(1, "step");
  add_argument(command, number_argument("count", {5}));
  const reply_t first = handle(command);
  const reply_t second = handle(command);
  EXPECT_EQ(messaging::encode(first), messaging::encode(second));
  EXPECT_EQ(simulation_.steps(), 5);
  command.client_id = "another";
  handle(command);
  EXPECT_EQ(simulation_.steps(), 10);
}

TEST_F(Commands, SequenceTooOldToKnow_Refused) {
  for (int i = 0; i < 100; ++i) send("step");
  const reply_t reply = handle(make_command(1, "step"));
  EXPECT_FALSE(reply.accepted);
  EXPECT_NE(reply.reason.find("too old"), std::string::npos);
  EXPECT_EQ(simulation_.steps(), 100);
}

TEST_F(Commands, Key_AnswersTimeAndPose) {
  send("step", {number_argument("count", {100})});
  const reply_t reply = send("key");
  EXPECT_EQ(result(reply, "time_us"), (std::vector<double>{100000}));
  EXPECT_EQ(result(reply, "pose"), (std::vector<double>{6}));
}

TEST_F(Commands, Reset_GoesBackToTheInitialPose) {
  send("grab", {text_argument("bone", "tip")});
  point(1, {0.5, 0, 1.3});
  send("step", {number_argument("count", {500})});
  ASSERT_TRUE(send("reset").accepted);
  EXPECT_EQ(simulation_.energy().elastic, 0.0);
  EXPECT_FALSE(simulation_.pointers().at(0).grip());
}

TEST_F(Commands, GetCharacter_PublishesItAndTheNewestPose) {
  EXPECT_TRUE(send("get_character").accepted);
  ASSERT_EQ(sink_.characters.size(), 1U);
  EXPECT_EQ(sink_.characters[0].joint_count, 4);
  ASSERT_EQ(sink_.poses.size(), 2U);
  EXPECT_EQ(sink_.poses[1].sequence, sink_.poses[0].sequence);
}

TEST_F(Commands, GetMesh_PublishesAllOrTheChunksAskedFor) {
  const reply_t reply = send("get_mesh");
  ASSERT_TRUE(reply.accepted);
  EXPECT_EQ(result(reply, "chunks"), (std::vector<double>{1}));
  ASSERT_EQ(sink_.chunks.size(), 1U);
  EXPECT_EQ(sink_.chunks[0].server_id, 77);
  EXPECT_TRUE(send("get_mesh", {number_argument("chunks", {0})}).accepted);
  EXPECT_EQ(sink_.chunks.size(), 2U);
}

TEST_F(Commands, GetMesh_SendsNothingBeforeItsTurnAndTheReplyBehindIt) {
  processor_.handle(make_command(1, "get_mesh"));
  processor_.handle(make_command(2, "key"));
  EXPECT_TRUE(sink_.chunks.empty());
  ASSERT_EQ(sink_.replies.size(), 1U);
  EXPECT_EQ(sink_.replies[0].sequence, 2);
  ASSERT_TRUE(processor_.is_sending_mesh());
  processor_.send_mesh_chunk();
  EXPECT_EQ(sink_.chunks.size(), 1U);
  ASSERT_EQ(sink_.replies.size(), 2U);
  EXPECT_EQ(sink_.replies[1].sequence, 1);
  EXPECT_FALSE(processor_.is_sending_mesh());
}

TEST_F(Commands, GetMeshWhileManyWait_RefusedAndTakenAgainLater) {
  const auto most = static_cast<std::int64_t>(CommandProcessor::kMaxMeshRequests);
  for (std::int64_t sequence = 1; sequence <= most + 1; ++sequence) {
    processor_.handle(make_command(sequence, "get_mesh"));
  }
  ASSERT_EQ(sink_.replies.size(), 1U);
  EXPECT_EQ(sink_.replies[0].sequence, most + 1);
  EXPECT_EQ(sink_.replies[0].reason, "64 requests for the mesh are being served: try again");
  while (processor_.is_sending_mesh()) processor_.send_mesh_chunk();
  EXPECT_EQ(sink_.chunks.size(), CommandProcessor::kMaxMeshRequests);
  processor_.handle(make_command(most + 2, "get_mesh"));
  EXPECT_TRUE(processor_.is_sending_mesh());
}

TEST_F(Commands, GetMeshBeyondTheLast_RefusedAndNothingSent) {
  EXPECT_FALSE(send("get_mesh", {number_argument("chunks", {1})}).accepted);
  EXPECT_FALSE(send("get_mesh", {number_argument("chunks", {-1})}).accepted);
  EXPECT_FALSE(send("get_mesh", {number_argument("chunks", {0, 0})}).accepted);
  EXPECT_TRUE(sink_.chunks.empty());
}

TEST_F(Commands, Shutdown_Requested) {
  EXPECT_FALSE(processor_.shutdown_requested());
  EXPECT_TRUE(send("shutdown").accepted);
  EXPECT_TRUE(processor_.shutdown_requested());
}

/// The poses and forces of a script of two hands.
std::vector<messaging::Bytes> play_script() {
  RecordingSink sink;
  Simulation simulation(testing::small_doll(), {.clock = ClockKind::kLockstep});
  PosePublisher poses(simulation, sink, 77);
  session::SnapshotFile snapshots(simulation.doll(), {});
  CommandProcessor processor(simulation, poses, sink, snapshots, 77);
  poses.publish_if_due();
  std::int64_t sequence = 0;
  const auto send = [&](const std::string& name, const std::vector<argument_t>& arguments) {
    command_t command = make_command(++sequence, name);
    for (const argument_t& argument : arguments) add_argument(command, argument);
    processor.handle(command);
    EXPECT_TRUE(sink.replies.back().accepted) << sink.replies.back().reason;
  };
  send("grab", {text_argument("bone", "tip")});
  send("grab", {text_argument("bone", "spine"), number_argument("pointer", {1}), text_argument("mode", "6dof")});
  for (int i = 1; i <= 30; ++i) {
    simulation.point(0, {{0.6 - 0.01 * i, 0.003 * i, 1.0 + 0.01 * i}, Eigen::Quaterniond::Identity()}, "test", i);
    send("step", {number_argument("count", {16}), number_argument("pointer_sequence", {0, static_cast<double>(i)})});
  }
  send("release", {});
  send("step", {number_argument("count", {500})});
  std::vector<messaging::Bytes> bytes;
  for (const pose_t& pose : sink.poses) bytes.push_back(messaging::encode(pose));
  for (const force_t& force : sink.forces) bytes.push_back(messaging::encode(force));
  return bytes;
}

TEST(LockstepScript, PlayedTwice_GivesIdenticalBytes) {
  const std::vector<messaging::Bytes> first = play_script();
  EXPECT_GT(first.size(), 50U);
  EXPECT_EQ(first, play_script());
}

}  // namespace
}  // namespace layfigure::app
