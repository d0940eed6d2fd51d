#include "mirror.h"

#include <gtest/gtest.h>

#include "layfigure/doll/build.h"
#include "person_fixture.h"
#include "rig_fixture.h"

namespace layfigure::doll {
namespace {

using Eigen::Vector3d;

/// The rig with its names replaced by numbers.
character::Rig nameless(character::Rig rig) {
  for (std::size_t b = 0; b < rig.bones.size(); ++b) rig.bones[b].name = "bone" + std::to_string(b);
  return rig;
}

BodyPlace place(const std::string& bone, int parent, const Vector3d& joint) {
  return {bone,
          read_bone_names({bone})[0],
          parent,
          joint,
          joint + Vector3d(0, 0, 0.1),
          Eigen::Quaterniond::Identity(),
          Eigen::Quaterniond::Identity()};
}

TEST(Mirror, Person_PairsLeftWithRightAndTheMiddleWithItself) {
  const Doll doll = build_doll(test::make_person());
  for (std::size_t b = 0; b < doll.definition.bodies.size(); ++b) {
    const std::string& name = doll.definition.bodies[b].name;
    const std::string expected = name.starts_with("Left")    ? "Right" + name.substr(4)
                                 : name.starts_with("Right") ? "Left" + name.substr(5)
                                                             : name;
    ASSERT_GE(doll.mirror_of_body[b], 0) << name;
    EXPECT_EQ(doll.definition.bodies[doll.mirror_of_body[b]].name, expected);
  }
}

TEST(Mirror, PersonWithoutNames_HasTheSamePairs) {
  const character::Rig rig = test::moved(test::make_person(), test::odd_motion());
  EXPECT_EQ(build_doll(nameless(rig)).mirror_of_body, build_doll(rig).mirror_of_body);
}

TEST(Mirror, LayoutOfANamedPair_HasItsPlaneWithTheNormalToTheLeft) {
  std::vector<std::string> warnings;
  const BodyLayout layout{place("hips", -1, {1, 0, 0}), place("arm_R", 0, {1, 2, 0}), place("arm_L", 0, {1, -2, 0})};
  const Mirror mirror = find_mirror(layout, warnings);
  ASSERT_TRUE(mirror.found);
  EXPECT_LT((mirror.normal - Vector3d(0, -1, 0)).norm(), 1e-12);
  EXPECT_NEAR(mirror.offset, 0.0, 1e-12);
  EXPECT_EQ(mirror.mirror_of_body, (std::vector<int>{0, 2, 1}));
  EXPECT_LT((mirror.reflected({1, 2, 3}) - Vector3d(1, -2, 3)).norm(), 1e-12);
  EXPECT_TRUE(warnings.empty());
}

TEST(Mirror, PairByNameInOtherPlaces_IsNoneAndIsReported) {
  std::vector<std::string> warnings;
  const BodyLayout layout{place("hips", -1, {0, 0, 0}),      place("arm_L", 0, {1, 0, 1}),
                          place("arm_R", 0, {-1, 0, 1}),     place("leg_L", 0, {0.3, 0, -1}),
                          place("leg_R", 0, {-0.3, 0, -1}),  place("sword_L", 1, {1.2, 0.2, 1}),
                          place("sword_R", 2, {-1.2, -1, 2})};
  const Mirror mirror = find_mirror(layout, warnings);
  ASSERT_TRUE(mirror.found);
  EXPECT_LT((mirror.normal - Vector3d::UnitX()).norm(), 1e-12);  // the swords do not tilt the plane
  EXPECT_EQ(mirror.mirror_of_body, (std::vector<int>{0, 2, 1, 4, 3, -1, -1}));
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("1 pairs"), std::string::npos);
  EXPECT_NE(warnings[0].find("'sword_L'"), std::string::npos);
}

TEST(Mirror, NamesOfOneSideInThePlacesOfAPair_AreNone) {
  std::vector<std::string> warnings;
  const BodyLayout layout{place("hips", -1, {0, 0, 0}), place("arm_L", 0, {1, 0, 1}), place("arm_R", 0, {-1, 0, 1}),
                          place("bag_L", 0, {0.5, 0, 0}), place("box_R", 0, {-0.5, 0, 0})};
  EXPECT_EQ(find_mirror(layout, warnings).mirror_of_body, (std::vector<int>{0, 2, 1, -1, -1}));
}

TEST(Mirror, ChainAlone_HasNone) {
  const Doll doll = build_doll(test::make_prism({.bones = 3}));
  EXPECT_EQ(doll.mirror_of_body, (std::vector<int>{-1, -1, -1}));
}

TEST(Mirror, NoBodies_NoMirror) {
  std::vector<std::string> warnings;
  EXPECT_FALSE(find_mirror({}, warnings).found);
}

TEST(Mirror, AllBodiesInOnePlace_NoMirror) {
  std::vector<std::string> warnings;
  const BodyLayout layout{place("a", -1, {0, 0, 0}), place("arm_L", 0, {0, 0, 0}), place("arm_R", 0, {0, 0, 0})};
  EXPECT_FALSE(find_mirror(layout, warnings).found);
  EXPECT_EQ(warnings.size(), 1U);
}

}  // namespace
}  // namespace layfigure::doll
