// Snapshots, poses, locks, and what `set` does to joints.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <numbers>

#include "edit_commands_fixture.h"

namespace layfigure::app {
namespace {

// ---------------------------------------------------------------- set

TEST_F(EditCommands, Set_Amounts_AsASettingsFileWouldHaveThem) {
  ASSERT_TRUE(send("set", {text_argument("bone", "arm"), number_argument("stiffness", {9.0}),
                           number_argument("damping.factor", {0.5}), number_argument("yield_torque.twist", {6.0}),
                           number_argument("hardening", {2.0})})
                  .accepted);
  EXPECT_EQ(law(kArm).stiffness, 9.0);
  EXPECT_EQ(law(kArm).damping, 0.2);
  EXPECT_EQ(law(kArm).yield_torque * law(kArm).shape.yield[0], 6.0);
  EXPECT_EQ(law(kArm).yield_torque * law(kArm).shape.yield[1], 3.0);
  EXPECT_EQ(law(kArm).hardening, 2.0);
  EXPECT_EQ(law(kSpine).stiffness, 40.0);
}

TEST_F(EditCommands, Set_FactorTwice_IsTheSameAsOnce) {
  for (int k = 0; k < 2; ++k) send("set", {text_argument("bone", "arm"), number_argument("stiffness.factor", {2.0})});
  EXPECT_EQ(law(kArm).stiffness, 80.0);
}

TEST_F(EditCommands, Set_Pattern_IsForAllThatItMatches) {
  const reply_t reply = send("set", {text_argument("bone", "*"), number_argument("stiffness", {5.0})});
  EXPECT_EQ(result(reply, "joints"), (std::vector<double>{1.0, 2.0}));
  EXPECT_EQ(law(kArm).stiffness, 5.0);
  EXPECT_EQ(law(kSpine).stiffness, 5.0);
  EXPECT_FALSE(sink_.characters.empty()) << "who looks on is told";
}

TEST_F(EditCommands, Set_Gravity_LetsTheDollHangUpwards) {
  steps(1000);
  const double sag = simulation_.state().bodies[kSpine].rotation.y();
  send("set", {number_argument("gravity", {0.0, 0.0, 9.81})});
  steps(3000);
  EXPECT_LT(simulation_.state().bodies[kSpine].rotation.y() * sag, 0.0);
}

TEST_F(EditCommands, Set_WhileFingertipIsOut_KeepsIt) {
  point(++pointed_, {0.3, 0.0, 1.3});
  ASSERT_TRUE(send("touch").accepted);
  steps(10);
  ASSERT_TRUE(send("set", {number_argument("stiffness.factor", {2.0})}).accepted);
  steps(10);
  EXPECT_EQ(simulation_.hands().busy_pointers(), std::vector<int>{0});
}

// ---------------------------------------------------------------- what joints are

TEST_F(EditCommands, GetJoints_TellsWhatWasSet_AndWhatWasChosen) {
  send("set",
       {text_argument("bone", "arm"), number_argument("stiffness", {9.0}), number_argument("yield_torque.twist", {6.0}),
        number_argument("limits.twist", {-0.5, 0.25}), number_argument("limits.swing_z", {-0.75, 1.0})});
  send("lock", {text_argument("bone", "arm"), text_argument("axes", "bend_y")});
  const reply_t now = send("get_joints");
  EXPECT_EQ(result(now, "joints"), (std::vector<double>{1.0, 2.0}));
  EXPECT_EQ(result(now, "stiffness"), (std::vector<double>{40.0, 9.0}));
  EXPECT_EQ(result(now, "yield_torque"), (std::vector<double>{3.0, 3.0}));
  EXPECT_EQ(result(now, "yield_torque.ratios"), (std::vector<double>{1.0, 1.0, 1.0, 2.0, 1.0, 1.0}));
  EXPECT_EQ(result(now, "damping"), (std::vector<double>{0.4, 0.4}));
  EXPECT_EQ(result(now, "flow_damping"), (std::vector<double>{2.0, 2.0}));
  EXPECT_EQ(result(now, "hardening"), (std::vector<double>{0.0, 0.0}));
  EXPECT_EQ(result(now, "limits.twist"), (std::vector<double>{-kInfinity, kInfinity, -0.5, 0.25}));
  EXPECT_EQ(result(now, "limits.swing_z"), (std::vector<double>{-kInfinity, kInfinity, -0.75, 1.0}));
  EXPECT_EQ(result(now, "locked"), (std::vector<double>{0.0, 0.0, 0.0, 0.0, 1.0, 0.0}));
  EXPECT_EQ(result(now, "section_axes"), (std::vector<double>{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0}));
  const reply_t chosen = send("get_joints", {text_argument("bone", "arm"), text_argument("of", "chosen")});
  EXPECT_EQ(result(chosen, "joints"), (std::vector<double>{2.0}));
  EXPECT_EQ(result(chosen, "stiffness"), (std::vector<double>{40.0}));
  EXPECT_EQ(result(chosen, "yield_torque.ratios"), (std::vector<double>{1.0, 1.0, 1.0}));
  EXPECT_EQ(result(chosen, "limits.twist"), (std::vector<double>{-kInfinity, kInfinity}));
  EXPECT_EQ(result(chosen, "locked"), (std::vector<double>{0.0, 0.0, 0.0}));
}

TEST_F(EditCommands, GetJoints_IsNoStepOfTheHistory) {
  send("get_joints");
  EXPECT_EQ(simulation_.history().undoable(), 0u);
}

// ---------------------------------------------------------------- locks

TEST_F(EditCommands, Lock_StrainedJoint_StaysWhereItIsAndIsGivenBackItsStrain) {
  steps(2000);
  const double strained = strain(kArm);
  ASSERT_GT(strained, 1e-3);
  const Eigen::Quaterniond before = simulation_.state().bodies[kArm].rotation;
  const Eigen::Quaterniond rest = simulation_.state().bodies[kArm].rest_rotation;
  const reply_t locked = send("lock", {text_argument("bone", "arm")});
  ASSERT_TRUE(locked.accepted) << locked.reason;
  EXPECT_EQ(result(locked, "joints"), std::vector<double>{2.0});
  send("grab", {text_argument("bone", "tip")});
  point(++pointed_, {0.6, 0.0, 1.2});
  steps(500);
  EXPECT_LT(simulation_.state().bodies[kArm].rotation.angularDistance(before), 1e-6);
  send("release");
  ASSERT_TRUE(send("unlock", {text_argument("bone", "arm")}).accepted);
  EXPECT_LT(simulation_.state().bodies[kArm].rest_rotation.angularDistance(rest), 1e-6);
}

TEST_F(EditCommands, Lock_OneAxis_LeavesTheOthers) {
  ASSERT_TRUE(send("lock", {text_argument("bone", "arm"), text_argument("axes", "twist bend_z")}).accepted);
  EXPECT_EQ(law(kArm).shape.locked, (std::array<bool, 3>{true, false, true}));
  steps(2000);
  const Eigen::Vector3d turned = math::log_rotation(simulation_.state().bodies[kArm].rotation);
  EXPECT_LT(std::abs(turned[0]), 1e-6);
  EXPECT_GT(std::abs(turned[1]), 1e-3) << "it sags about the axis that is free";
}

TEST_F(EditCommands, LockAndUnlock_ManyTimes_DoNotLetTheJointCreep) {
  steps(3000);
  const Eigen::Quaterniond before = simulation_.state().bodies[kArm].rotation;
  for (int k = 0; k < 20; ++k) {
    send("lock", {text_argument("bone", "arm")});
    steps(50);
    send("unlock");
    steps(50);
  }
  EXPECT_LT(simulation_.state().bodies[kArm].rotation.angularDistance(before), 1e-3);
}

// ---------------------------------------------------------------- snapshots

class SnapshotCommands : public EditCommands {
 protected:
  SnapshotCommands() : file_(std::filesystem::temp_directory_path() / ("snapshots_" + std::to_string(getpid()))) {
    snapshots_ = session::SnapshotFile(simulation_.doll(), file_ / "of.snapshots");
  }
  ~SnapshotCommands() override { std::filesystem::remove_all(file_); }
  std::filesystem::path file_;
};

TEST_F(SnapshotCommands, Restore_PutsTheDollBackBitForBit_AndCanBeUndone) {
  lift(0.3);
  const std::string kept = memory();
  ASSERT_TRUE(send("snapshot", {text_argument("name", "lifted")}).accepted);
  lift(-0.4);
  const std::string lowered = memory();
  const reply_t reply = send("snapshot", {text_argument("name", "lifted"), text_argument("action", "restore")});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(memory(), kept);
  send("undo");
  EXPECT_EQ(memory(), lowered);
}

TEST_F(SnapshotCommands, ListAndRemove) {
  for (const char* name : {"b", "a"}) send("snapshot", {text_argument("name", name)});
  const reply_t both = send("snapshot", {text_argument("action", "list")});
  ASSERT_EQ(both.result_count, 2);
  EXPECT_EQ(both.results[0].text, "b");
  EXPECT_EQ(both.results[1].text, "a");
  EXPECT_TRUE(send("snapshot", {text_argument("name", "b"), text_argument("action", "remove")}).accepted);
  EXPECT_EQ(send("snapshot", {text_argument("action", "list")}).result_count, 1);
  EXPECT_EQ(send("snapshot", {text_argument("name", "b"), text_argument("action", "restore")}).reason,
            "there is no snapshot 'b'");
}

TEST_F(EditCommands, Snapshot_NoPlaceForIt_RefusedWithWhatToDo) {
  EXPECT_EQ(send("snapshot", {text_argument("name", "x")}).reason,
            "there is no place for snapshots: set HOME or XDG_STATE_HOME");
}

// ---------------------------------------------------------------- load_pose

class PoseCommand : public EditCommands {
 protected:
  static argument_t rotation(const Eigen::Quaterniond& q) {
    return number_argument("rotations", {q.w(), q.x(), q.y(), q.z()});
  }
  const Eigen::Quaterniond target_{Eigen::AngleAxisd(0.8, Eigen::Vector3d(0.3, 1.0, -0.2).normalized())};
};

TEST_F(PoseCommand, OneJoint_GetsThereAndStaysThere) {
  steps(2000);
  const Eigen::Quaterniond spine = simulation_.state().bodies[kSpine].rotation;
  const reply_t reply = send("load_pose", {number_argument("joints", {2.0}), rotation(target_)});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(result(reply, "driven"), std::vector<double>{1.0});
  steps(1500);
  const reply_t state = send("load_pose", {text_argument("action", "state")});
  EXPECT_EQ(result(state, "driven"), std::vector<double>{0.0}) << "it lets go when it has arrived";
  EXPECT_LT(simulation_.state().bodies[kArm].rotation.angularDistance(target_), 0.005);
  steps(3000);
  EXPECT_LT(simulation_.state().bodies[kArm].rotation.angularDistance(target_), 0.01) << "without sagging";
  EXPECT_LT(simulation_.state().bodies[kSpine].rotation.angularDistance(spine), 0.05);
  EXPECT_EQ(simulation_.state().bodies[kArm].yield_scale, 1.0);
}

TEST_F(PoseCommand, Stream_IsFollowed_AndIsOneStepOfTheHistory) {
  const std::string before = memory();
  for (int k = 1; k <= 60; ++k) {
    const Eigen::Quaterniond now(Eigen::AngleAxisd(0.01 * k, Eigen::Vector3d::UnitZ()));
    ASSERT_TRUE(send("load_pose", {number_argument("joints", {2.0}), rotation(now),
                                   number_argument("duration", {0.016}), number_argument("hold", {1.0})})
                    .accepted);
    steps(16);
    EXPECT_LT(simulation_.state().bodies[kArm].rotation.angularDistance(now), 0.02) << k;
  }
  EXPECT_EQ(simulation_.history().undoable(), 1u);
  send("undo");
  EXPECT_EQ(memory(), before);
  EXPECT_FALSE(simulation_.hands().pose_drives().active());
}

TEST_F(PoseCommand, WeakDrive_DoesNotGetThere_UntilCancelled) {
  send("pin", {text_argument("bone", "arm"), text_argument("mode", "6dof"), text_argument("hold", "rigid")});
  send("load_pose", {number_argument("joints", {2.0}), rotation(target_), number_argument("max_torque", {0.01})});
  steps(2000);
  EXPECT_EQ(result(send("load_pose", {text_argument("action", "state")}), "on_the_way"), std::vector<double>{1.0});
  EXPECT_EQ(result(send("load_pose", {text_argument("action", "cancel")}), "driven"), std::vector<double>{0.0});
}

TEST_F(PoseCommand, WholePose_OfThePoseMessage_ChangesNothing) {
  steps(2000);
  poses_.publish();
  std::vector<double> rotations;
  for (const auto& q : sink_.poses.back().rotations) rotations.insert(rotations.end(), q.begin(), q.end());
  const Eigen::Quaterniond before = simulation_.state().bodies[kArm].rotation;
  ASSERT_TRUE(send("load_pose", {number_argument("rotations", rotations)}).accepted);
  steps(2000);
  EXPECT_LT(simulation_.state().bodies[kArm].rotation.angularDistance(before), 0.006);
}

TEST_F(PoseCommand, Put_IsThereAtOnce_IsOneStepOfTheHistory) {
  steps(500);
  const Eigen::Quaterniond before = simulation_.state().bodies[kArm].rotation;
  const reply_t reply =
      send("load_pose", {number_argument("joints", {2.0}), rotation(target_), text_argument("action", "put")});
  ASSERT_TRUE(reply.accepted) << reply.reason;
  EXPECT_LT(simulation_.state().bodies[kArm].rotation.angularDistance(target_), 1e-12);
  steps(2000);
  EXPECT_LT(simulation_.state().bodies[kArm].rotation.angularDistance(target_), 1e-5) << "without sagging";
  EXPECT_EQ(simulation_.history().undoable(), 1u);
  send("undo");
  EXPECT_LT(simulation_.state().bodies[kArm].rotation.angularDistance(before), 1e-12);
}

TEST_F(PoseCommand, BadInput_RefusedAndNothingChanges) {
  const std::string before = fingerprint();
  const argument_t arm = number_argument("joints", {2.0});
  const std::vector<std::vector<argument_t>> bad{
      {},
      {arm},
      {rotation(target_)},
      {arm, number_argument("rotations", {1.0, 0.0, 0.0})},
      {arm, number_argument("rotations", {1.0, 0.0, 0.0, kNaN})},
      {arm, number_argument("rotations", {0.5, 0.0, 0.0, 0.0})},
      {arm, text_argument("rotations", "up")},
      {number_argument("joints", {9.0}), rotation(target_)},
      {number_argument("joints", {-1.0}), rotation(target_)},
      {number_argument("joints", {0.0}), rotation(target_)},
      {number_argument("joints", {3.0}), rotation(target_)},
      {number_argument("joints", {2.0, 2.0}), number_argument("rotations", {1, 0, 0, 0, 1, 0, 0, 0})},
      {arm, rotation(target_), number_argument("duration", {0.0})},
      {arm, rotation(target_), number_argument("duration", {kNaN})},
      {arm, rotation(target_), number_argument("max_torque", {-1.0})},
      {arm, rotation(target_), number_argument("hold", {0.5})},
      {arm, rotation(target_), text_argument("action", "cancel")},
      {arm, text_argument("action", "put")},
      {arm, rotation(target_), text_argument("action", "put"), number_argument("hold", {1.0})},
      {number_argument("joints", {0.0}), rotation(target_), text_argument("action", "put")},
      {text_argument("action", "dance")}};
  for (const auto& arguments : bad) {
    EXPECT_FALSE(send("load_pose", arguments).accepted) << (arguments.empty() ? "" : arguments.back().name);
    EXPECT_EQ(fingerprint(), before);
  }
}

// ---------------------------------------------------------------- what is refused

TEST_F(EditCommands, BadInput_OfEachKind_RefusedAndNothingChanges) {
  lift(0.3);
  const std::vector<std::pair<std::string, std::vector<argument_t>>> bad{
      {"set", {}},
      {"set", {text_argument("bone", "arm")}},
      {"set", {text_argument("bone", "leg"), number_argument("stiffness", {1.0})}},
      {"set", {text_argument("bone", "*leg*"), number_argument("stiffness", {1.0})}},
      {"set", {text_argument("bone", "hips"), number_argument("stiffness", {1.0})}},
      {"set", {text_argument("bone", "tip"), number_argument("stiffness", {1.0})}},
      {"set", {number_argument("stiffness", {kNaN})}},
      {"set", {number_argument("stiffness", {-1.0})}},
      {"set", {number_argument("stiffness", {})}},
      {"set", {number_argument("stiffness", {1.0, 2.0})}},
      {"set", {text_argument("stiffness", "stiff")}},
      {"set", {number_argument("stiffness", {1.0}), number_argument("stiffness.factor", {2.0})}},
      {"set", {number_argument("stiffness", {1.0}), number_argument("stiffness.twist", {2.0})}},
      {"set", {number_argument("damping", {kInfinity})}},
      {"set", {number_argument("stiffness.factor", {kInfinity})}},
      {"set", {number_argument("yield_torque.bend_y", {0.0})}},
      {"set", {number_argument("hardening", {kNaN})}},
      {"set", {number_argument("limits.twist", {-30.0, 30.0})}},
      {"set", {number_argument("limits.twist", {0.1, 0.2})}},
      {"set", {number_argument("limits.swing_y", {-1.0})}},
      {"set", {number_argument("limits.swing_z", {kNaN, 1.0})}},
      {"set", {number_argument("gravity", {0.0, 0.0, kNaN})}},
      {"set", {number_argument("gravity", {-9.81})}},
      {"set", {number_argument("gravity", {0.0, 0.0, 1e9})}},
      {"set", {text_argument("bone", "arm"), number_argument("gravity", {0.0, 0.0, 1.0})}},
      {"set", {number_argument("mass", {1.0})}},
      {"set", {number_argument("softness", {kNaN})}},
      {"lock", {}},
      {"lock", {text_argument("bone", "leg")}},
      {"lock", {text_argument("bone", "hips")}},
      {"lock", {number_argument("bone", {1.0})}},
      {"lock", {text_argument("bone", "arm"), text_argument("axes", "roll")}},
      {"lock", {text_argument("bone", "arm"), number_argument("axes", {1.0})}},
      {"unlock", {text_argument("bone", "leg")}},
      {"get_joints", {text_argument("bone", "leg")}},
      {"get_joints", {text_argument("bone", "hips")}},
      {"get_joints", {text_argument("bone", "tip")}},
      {"get_joints", {text_argument("of", "then")}},
      {"undo", {number_argument("steps", {1.0})}},
      {"redo", {}},
      {"redo", {number_argument("branch", {kNaN})}},
      {"redo", {number_argument("branch", {-1.0})}},
      {"redo", {number_argument("branch", {0.5})}},
      {"history", {text_argument("action", "go")}},
      {"history", {text_argument("action", "back")}},
      {"history", {number_argument("action", {1.0})}},
      {"history", {number_argument("place", {0.0})}},
      {"history", {text_argument("action", "go"), text_argument("place", "start")}},
      {"history", {text_argument("action", "go"), number_argument("place", {-1.0})}},
      {"history", {text_argument("action", "go"), number_argument("place", {0.5})}},
      {"history", {text_argument("action", "go"), number_argument("place", {kNaN})}},
      {"history", {text_argument("action", "go"), number_argument("place", {1e300})}},
      {"history", {text_argument("action", "go"), number_argument("place", {1.0, 2.0})}},
      {"history", {text_argument("action", "go"), number_argument("place", {99.0})}},
      {"snapshot", {}},
      {"snapshot", {number_argument("name", {1.0})}},
      {"snapshot", {text_argument("name", std::string(65, 'x'))}},
      {"snapshot", {text_argument("name", "x"), text_argument("action", "dance")}},
      {"snapshot", {text_argument("name", "x"), text_argument("action", "list")}},
      {"snapshot", {text_argument("name", "x"), text_argument("action", "restore")}},
      {"mirror", {}},  // this doll has no left and right
      {"mirror", {text_argument("side", "up")}},
      {"reset", {number_argument("all", {2.0})}},
      {"unpin", {number_argument("pin", {99.0})}},
  };
  const std::string before = fingerprint();
  for (const auto& [name, arguments] : bad) {
    const reply_t reply = send(name, arguments);
    EXPECT_FALSE(reply.accepted) << name << " " << (arguments.empty() ? "" : arguments.back().name);
    EXPECT_FALSE(reply.reason.empty());
    EXPECT_EQ(reply.reason.find('\n'), std::string::npos);
    EXPECT_EQ(fingerprint(), before) << name << " " << (arguments.empty() ? "" : arguments.back().name);
  }
}

}  // namespace
}  // namespace layfigure::app
