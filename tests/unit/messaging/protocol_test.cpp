#include "layfigure/messaging/protocol.h"

#include <gtest/gtest.h>

namespace layfigure::messaging {
namespace {

TEST(ChannelName, WithPrefix_PutsItFirst) {
  EXPECT_EQ(channel_name("", Channel::kPose), "LAYFIGURE_POSE");
  EXPECT_EQ(channel_name("left_", Channel::kStatus), "left_LAYFIGURE_STATUS");
}

TEST(StateChannel, OfEachKind_OnlyWhereNewestWins) {
  for (const Channel channel : {Channel::kPose, Channel::kForce, Channel::kStatus, Channel::kPointer,
                                Channel::kSpidarState, Channel::kSpidarCommand}) {
    EXPECT_TRUE(is_state_channel(channel_name("p", channel))) << channel_name("p", channel);
  }
  for (const Channel channel : {Channel::kCommand, Channel::kReply, Channel::kCharacter, Channel::kMesh}) {
    EXPECT_FALSE(is_state_channel(channel_name("p", channel))) << channel_name("p", channel);
  }
  EXPECT_FALSE(is_state_channel("SOMETHING_ELSE"));
}

TEST(ChannelPrefix, WordCharacters_Allowed) {
  EXPECT_TRUE(is_channel_prefix(""));
  EXPECT_TRUE(is_channel_prefix("Scene_2"));
}

TEST(ChannelPrefix, RegexCharactersOrTooLong_Refused) {
  EXPECT_FALSE(is_channel_prefix("a.b"));
  EXPECT_FALSE(is_channel_prefix("a b"));
  EXPECT_FALSE(is_channel_prefix("\xc3\xa4"));
  EXPECT_FALSE(is_channel_prefix(std::string(41, 'a')));
}

TEST(ChannelPrefix, OfGreatestLength_FitsIntoLcmNames) {
  EXPECT_LE(channel_name(std::string(40, 'a'), Channel::kCharacter).size(), kMaxChannelLength);
}

}  // namespace
}  // namespace layfigure::messaging
