#include "layfigure/app/commands.h"

#include <gtest/gtest.h>

#include <limits>

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
