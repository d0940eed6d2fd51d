#include "layfigure/app/messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <layfigure/meshes_t.hpp>
#include <limits>

#include "layfigure/app/mesh_chunks.h"
#include "layfigure/messaging/protocol.h"
#include "small_doll.h"

namespace layfigure::app {
namespace {

Simulation make_simulation() { return Simulation(testing::small_doll(), {.clock = ClockKind::kLockstep}); }

TEST(MakeCharacter, OfTheSmallDoll_DescribesEachJoint) {
  const character_t character = make_character(make_simulation(), 5, 1234);
  EXPECT_EQ(character.protocol_version, messaging::kProtocolVersion);
  EXPECT_EQ(character.server_id, 5);
  EXPECT_EQ(character.name, "small");
  EXPECT_EQ(character.clock, "lockstep");
  EXPECT_EQ(character.mesh_bytes, 1234);
  EXPECT_EQ(static_cast<std::uint64_t>(character.content_hash), 0xfedcba9876543210U);
  ASSERT_EQ(character.joint_count, 4);
  EXPECT_EQ(character.joints[2].name, "arm");
  EXPECT_EQ(character.joints[2].parent, 1);
  EXPECT_EQ(character.joints[2].rest_translation[0], 0.2);
  EXPECT_EQ(character.joints[2].bind_translation[0], 0.4);
  EXPECT_EQ(character.joints[2].bind_rotation[0], 1.0);
  EXPECT_EQ(character.joints[2].mass, 0.2);
  EXPECT_EQ(character.joints[2].yield_torque, 3.0);
}

TEST(MakeCharacter, FreeRootAndRider_HaveNoJointLaw) {
  const character_t character = make_character(make_simulation(), 5, 0);
  EXPECT_TRUE(character.joints[0].is_body);
  EXPECT_EQ(character.joints[0].stiffness, 0.0);
  EXPECT_TRUE(std::isinf(character.joints[0].yield_torque));
  EXPECT_FALSE(character.joints[3].is_body);
  EXPECT_EQ(character.joints[3].mass, 0.0);
  EXPECT_TRUE(std::isinf(character.joints[3].yield_torque));
}

TEST(MakePose, AtTheStart_IsTheRestPose) {
  doll::SkeletonPose skeleton;
  const pose_t pose = make_pose(make_simulation(), 5, 9, skeleton);
  EXPECT_EQ(pose.sequence, 9);
  EXPECT_EQ(pose.root_translation[2], 1.0);
  ASSERT_EQ(pose.rotations.size(), 4U);
  EXPECT_EQ(pose.rotations[3], (std::vector<double>{1, 0, 0, 0}));
  EXPECT_EQ(pose.yielded, (std::vector<std::int8_t>{0, 0, 0, 0}));
  EXPECT_EQ(messaging::encode(pose).size(), static_cast<std::size_t>(pose.getEncodedSize()));
}

TEST(MakePose, UnderGravity_ReportsTheTorqueThatHoldsTheArm) {
  Simulation simulation = make_simulation();
  for (int i = 0; i < 3000; ++i) ASSERT_TRUE(simulation.advance());
  doll::SkeletonPose skeleton;
  const pose_t pose = make_pose(simulation, 5, 0, skeleton);
  // The strain of a sagging arm pulls it up, and so presses its parent down: m g l / 2 about -y or y of the level arm.
  const double expected = 0.2 * 9.81 * 0.1;
  EXPECT_NEAR(std::abs(pose.torques[2][1]), expected, 0.01 * expected);
  EXPECT_EQ(pose.torques[3], (std::vector<float>{0, 0, 0}));
}

TEST(MakeStatus, AfterSomeSteps_CountsThem) {
  Simulation simulation = make_simulation();
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(simulation.advance());
  const status_t status = make_status(simulation, 5);
  EXPECT_EQ(status.state, "running");
  EXPECT_EQ(status.steps, 10);
  EXPECT_EQ(status.time_us, 10000);
  EXPECT_GT(status.step_us_max, 0.0);
  EXPECT_GT(status.kinetic_energy, 0.0);
}

TEST(MeshChunks, PutTogether_AreTheMeshes) {
  doll::Doll doll = testing::small_doll();
  character::SkinnedMesh& mesh = doll.rig.meshes[0];
  for (int i = 0; i < 3000; ++i) {  // enough for several chunks
    mesh.vertices.emplace_back(i, 0.5, 0.25);
    mesh.influences.push_back({{2, 1.0}});
  }
  const MeshChunks chunks(doll.rig);
  ASSERT_GT(chunks.total(), 2);
  messaging::Bytes bytes;
  for (std::int32_t i = 0; i < chunks.total(); ++i) {
    const mesh_chunk_t chunk = chunks.chunk(i);
    EXPECT_EQ(chunk.index, i);
    EXPECT_EQ(chunk.total, chunks.total());
    EXPECT_LE(chunk.bytes.size(), messaging::kMeshChunkBytes);
    EXPECT_EQ(chunk.byte_count, static_cast<std::int32_t>(chunk.bytes.size()));
    bytes.insert(bytes.end(), chunk.bytes.begin(), chunk.bytes.end());
  }
  ASSERT_EQ(static_cast<std::int32_t>(bytes.size()), chunks.bytes());
  meshes_t meshes;
  ASSERT_EQ(meshes.decode(bytes.data(), 0, chunks.bytes()), chunks.bytes());
  ASSERT_EQ(meshes.mesh_count, 1);
  EXPECT_EQ(meshes.meshes[0].vertex_count, 3008);
  EXPECT_EQ(meshes.meshes[0].points[3007][0], 2999.0F);
  EXPECT_EQ(meshes.meshes[0].influence_count, 2);
  EXPECT_EQ(meshes.meshes[0].joint_weights[3007], (std::vector<float>{1.0F, 0.0F}));
  EXPECT_EQ(meshes.meshes[0].joint_weights[2], (std::vector<float>{0.75F, 0.25F}));
}

TEST(MeshChunks, Looks_AreSentWithTheMeshes) {
  doll::Doll doll = testing::small_doll();
  character::SkinnedMesh& mesh = doll.rig.meshes[0];
  mesh.material = 0;
  mesh.wedges.normals.assign(mesh.vertices.size() + 1, {0.0F, 0.6F, 0.8F});
  mesh.wedges.uvs.assign(mesh.vertices.size() + 1, {0.25F, 0.75F});
  mesh.wedges.triangles = mesh.triangles;
  doll.rig.materials.resize(1);
  doll.rig.materials[0].texture = "skin.png";
  doll.rig.materials[0].wrap = {character::Wrap::kClamp, character::Wrap::kMirror};
  doll.rig.images = {{"eye", "png", "\x89PNG"}};
  const MeshChunks chunks(doll.rig);
  meshes_t meshes;
  messaging::Bytes bytes;
  for (std::int32_t i = 0; i < chunks.total(); ++i) {
    const mesh_chunk_t chunk = chunks.chunk(i);
    bytes.insert(bytes.end(), chunk.bytes.begin(), chunk.bytes.end());
  }
  ASSERT_EQ(meshes.decode(bytes.data(), 0, chunks.bytes()), chunks.bytes());
  EXPECT_EQ(meshes.meshes[0].normal_count, meshes.meshes[0].vertex_count + 1);
  EXPECT_EQ(meshes.meshes[0].normals[3], (std::vector<float>{0.0F, 0.6F, 0.8F}));
  EXPECT_EQ(meshes.meshes[0].uvs[8], (std::vector<float>{0.25F, 0.75F}));
  EXPECT_EQ(meshes.meshes[0].wedge_triangles, meshes.meshes[0].triangles);
  ASSERT_EQ(meshes.material_count, 1);
  EXPECT_EQ(meshes.materials[0].texture, "skin.png");
  EXPECT_EQ(meshes.materials[0].wrap_u, "clamp");
  EXPECT_EQ(meshes.materials[0].wrap_v, "mirror");
  ASSERT_EQ(meshes.image_count, 1);
  EXPECT_EQ(meshes.images[0].bytes, (std::vector<std::uint8_t>{0x89, 'P', 'N', 'G'}));
}

}  // namespace
}  // namespace layfigure::app
