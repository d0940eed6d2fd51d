#include "layfigure/skinning/skin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <stdexcept>

#include "small_doll.h"
#include "tube_rig.h"

namespace layfigure::skinning {
namespace {

using character::Rig;
using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Skin, OfSeveralMeshes_HoldsOneAfterTheOther) {
  Rig rig = testing::small_doll().rig;
  rig.meshes.push_back(rig.meshes.front());
  const Skin skin(rig);
  const int count = static_cast<int>(rig.meshes.front().vertices.size());
  ASSERT_EQ(skin.meshes().size(), 2U);
  EXPECT_EQ(skin.meshes()[1].first, count);
  EXPECT_EQ(skin.meshes()[1].count, count);
  EXPECT_EQ(skin.vertex_count(), 2 * count);
  EXPECT_EQ(skin.bone_count(), 4);
  EXPECT_EQ(skin.bind_positions()[count + 3], rig.meshes.front().vertices[3]);
  const std::size_t triangles = rig.meshes.front().triangles.size();
  ASSERT_EQ(skin.triangles().size(), 2 * triangles);
  EXPECT_EQ(skin.triangles()[triangles + 1], rig.meshes.front().triangles[1] + Eigen::Vector3i::Constant(count));
}

TEST(Skin, InfluencesInAnyOrder_AreHeaviestFirst) {
  Rig rig = testing::small_doll().rig;
  rig.meshes.front().influences[0] = {{2, 0.125}, {0, 0.25}, {3, 0.625}};
  const Skin skin(rig);
  const auto influences = skin.influences(0);
  ASSERT_EQ(influences.size(), 3U);
  EXPECT_EQ(influences[0].bone, 3);
  EXPECT_EQ(influences[0].weight, 0.625);
  EXPECT_EQ(influences[1].bone, 0);
  EXPECT_EQ(influences[2].bone, 2);
  EXPECT_EQ(skin.influences(2).size(), 2U);
}

TEST(Skin, NormalsOfTube_PointAwayFromItsAxis) {
  const testing::Tube tube;
  const Skin skin(testing::tube_rig(tube));
  const int ring = tube.rings_per_bone;
  for (int k = 0; k < tube.sides; ++k) {
    const int vertex = testing::tube_vertex(tube, ring, k);
    Vector3d outwards = skin.bind_positions()[vertex];
    outwards.z() = 0.0;
    EXPECT_LT((skin.bind_normals()[vertex] - outwards.normalized()).norm(), 1e-12) << k;
  }
  EXPECT_LT((skin.bind_normals().back() - Vector3d::UnitZ()).norm(), 1e-12);  // the upper end
}

TEST(Skin, VertexWithoutTriangle_HasNormalZ) {
  Rig rig = testing::small_doll().rig;
  rig.meshes.front().triangles.clear();
  EXPECT_EQ(Skin(rig).bind_normals()[1], Vector3d::UnitZ());
}

struct BadRig {
  const char* name;
  std::function<void(Rig&)> spoil;
  std::vector<std::string> words;
};

class SkinOfBadRig : public ::testing::TestWithParam<BadRig> {};

TEST_P(SkinOfBadRig, IsRefusedByName) {
  Rig rig = testing::small_doll().rig;
  GetParam().spoil(rig);
  try {
    const Skin skin(rig);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    for (const std::string& word : GetParam().words) EXPECT_THAT(error.what(), HasSubstr(word));
  }
}

INSTANTIATE_TEST_SUITE_P(Skin, SkinOfBadRig,
                         ::testing::Values(BadRig{"BoneTooHigh",
                                                  [](Rig& rig) { rig.meshes[0].influences[3][0].bone = 4; },
                                                  {"mesh 'strip', vertex 3", "bone = 4", "0 to 3"}},
                                           BadRig{"BoneNegative",
                                                  [](Rig& rig) { rig.meshes[0].influences[3][0].bone = -1; },
                                                  {"mesh 'strip', vertex 3", "bone = -1", "0 to 3"}},
                                           BadRig{"WeightNegative",
                                                  [](Rig& rig) {
                                                    rig.meshes[0].influences[2] = {{0, 1.5}, {1, -0.5}};
                                                  },
                                                  {"mesh 'strip', vertex 2", "weight of bone 0 = 1.5", "(0, 1]"}},
                                           BadRig{"WeightNotANumber",
                                                  [](Rig& rig) { rig.meshes[0].influences[2][1].weight = kNan; },
                                                  {"mesh 'strip', vertex 2", "weight of bone 1 = nan", "(0, 1]"}},
                                           BadRig{"WeightsDoNotSumToOne",
                                                  [](Rig& rig) { rig.meshes[0].influences[2][1].weight = 0.125; },
                                                  {"mesh 'strip', vertex 2", "sum of weights = 0.875", "expected 1"}},
                                           BadRig{"NoInfluences",
                                                  [](Rig& rig) { rig.meshes[0].influences[5].clear(); },
                                                  {"mesh 'strip', vertex 5", "sum of weights = 0", "expected 1"}},
                                           BadRig{"ListMissing",
                                                  [](Rig& rig) { rig.meshes[0].influences.pop_back(); },
                                                  {"mesh 'strip'", "lists of influences = 7", "8, one per vertex"}},
                                           BadRig{"VertexNotFinite",
                                                  [](Rig& rig) { rig.meshes[0].vertices[1].y() = kNan; },
                                                  {"mesh 'strip', vertex 1", "position", "nan", "finite"}},
                                           BadRig{"CornerTooHigh",
                                                  [](Rig& rig) { rig.meshes[0].triangles[4][2] = 8; },
                                                  {"mesh 'strip', triangle 4", "corner = 8", "0 to 7"}},
                                           BadRig{"ParentLater",
                                                  [](Rig& rig) { rig.bones[1].parent = 2; },
                                                  {"bone 'spine' (1)", "parent = 2", "an earlier bone"}},
                                           BadRig{"BindScaled",
                                                  [](Rig& rig) { rig.bones[2].bind.linear() *= 2.0; },
                                                  {"bone 'arm' (2)", "bind", "a rotation and a translation"}},
                                           BadRig{"BindMirrored",
                                                  [](Rig& rig) { rig.bones[2].bind.linear() *= -1.0; },
                                                  {"bone 'arm' (2)", "bind", "a rotation and a translation"}},
                                           BadRig{"RestNotFinite",
                                                  [](Rig& rig) { rig.bones[3].rest.translation().x() = kNan; },
                                                  {"bone 'tip' (3)", "rest translation", "nan", "finite"}}),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace layfigure::skinning
