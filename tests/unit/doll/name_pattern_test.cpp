#include "name_pattern.h"

#include <gtest/gtest.h>

namespace layfigure::doll {
namespace {

using Names = std::vector<std::string>;

TEST(Matches, PlainNames_MatchThemselvesAlone) {
  EXPECT_TRUE(matches("Arm", "Arm"));
  EXPECT_FALSE(matches("Arm", "Arms"));
  EXPECT_FALSE(matches("Arm", "arm"));
  EXPECT_FALSE(matches("Arm", ""));
  EXPECT_TRUE(matches("", ""));
}

TEST(Matches, Star_StandsForAnyCharactersOrNone) {
  EXPECT_TRUE(matches("*", ""));
  EXPECT_TRUE(matches("*Arm", "Arm"));
  EXPECT_TRUE(matches("*Arm", "LeftArm"));
  EXPECT_FALSE(matches("*Arm", "LeftArmTwist"));
  EXPECT_TRUE(matches("*Arm*", "LeftArmTwist"));
  EXPECT_TRUE(matches("a*b*c", "a-b-b-c"));
  EXPECT_FALSE(matches("a*b*c", "a-c-b"));
  EXPECT_TRUE(matches("***", "x"));
}

TEST(Matches, QuestionMark_StandsForOneCharacter) {
  EXPECT_TRUE(matches("finger?", "finger1"));
  EXPECT_FALSE(matches("finger?", "finger"));
  EXPECT_FALSE(matches("finger?", "finger12"));
  EXPECT_TRUE(matches("*?", "x"));
  EXPECT_FALSE(matches("*?", ""));
}

TEST(Matches, QuestionMark_TakesAWholeUtf8Character) {
  EXPECT_TRUE(matches("腕?", "腕左"));
  EXPECT_FALSE(matches("??", "腕"));
  EXPECT_TRUE(matches("a?b",
                      "a\xff"
                      "b"));
}

TEST(Matches, BracketsAndBackslashes_AreThemselves) {
  EXPECT_TRUE(matches("[a]", "[a]"));
  EXPECT_FALSE(matches("[a]", "a"));
  EXPECT_TRUE(matches("a\\*", "a\\b"));
}

TEST(Matches, ManyStars_TakeNoTimeToSpeakOf) {
  std::string pattern;
  for (int k = 0; k < 200; ++k) pattern += "*a";
  EXPECT_FALSE(matches(pattern + "b", std::string(4000, 'a')));
}

TEST(NearNames, Misspelt_IsFoundBestFirst) {
  const Names names{"Hips", "LeftArm", "RightArm", "LeftForeArm", "LeftLeg"};
  EXPECT_EQ(near_names("LeftArn", names), (Names{"LeftArm"}));
  EXPECT_EQ(near_names("leftarm", names), (Names{"LeftArm"}));
  EXPECT_EQ(near_names("hip*", names), (Names{"Hips"}));
}

TEST(NearNames, PartOfLongerNames_IsFoundThreeAtMost) {
  const Names names{"m:Arm1", "m:Arm2", "m:Leg", "m:Arm3", "m:Arm4"};
  EXPECT_EQ(near_names("Arm", names), (Names{"m:Arm1", "m:Arm2", "m:Arm3"}));
}

TEST(NearNames, NothingAlike_IsNothing) {
  EXPECT_TRUE(near_names("Tentacle", {"Hips", "LeftArm"}).empty());
  EXPECT_TRUE(near_names("", {"Hips", "LeftArm"}).empty());
  EXPECT_TRUE(near_names("*", {}).empty());
}

}  // namespace
}  // namespace layfigure::doll
