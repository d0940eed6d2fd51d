#include "layfigure/messaging/codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "layfigure/messaging/protocol.h"
#include "sample_messages.h"

namespace layfigure::messaging {
namespace {

using testing::sample_command;
using testing::sample_pointer;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

pointer_t pointer_with(const std::function<void(pointer_t&)>& change) {
  pointer_t pointer = sample_pointer();
  change(pointer);
  return pointer;
}

TEST(DecodePointer, Sample_GivesTheFieldsBack) {
  const Decoded<pointer_t> decoded = decode_pointer(encode(sample_pointer()));
  ASSERT_TRUE(decoded.message) << decoded.problem;
  EXPECT_EQ(decoded.message->client_id, "client-1");
  EXPECT_EQ(decoded.message->sequence, 8);
  EXPECT_EQ(decoded.message->pointer, 1);
  EXPECT_EQ(decoded.message->position[2], -0.25);
  EXPECT_EQ(decoded.message->rotation[1], -0.5);
}

TEST(DecodeSpidarState, Sample_GivesTheFieldsBack) {
  const Decoded<spidar_state_t> decoded = decode_spidar_state(encode(testing::sample_spidar_state()));
  ASSERT_TRUE(decoded.message) << decoded.problem;
  EXPECT_EQ(decoded.message->device_id, "left");
  EXPECT_EQ(decoded.message->lengths[7], 1.125);
  EXPECT_EQ(decoded.message->grip, 0.75);
}

TEST(DecodeSpidarState, OutOfRange_RefusedWithTheReason) {
  const std::vector<std::pair<std::function<void(spidar_state_t&)>, std::string>> cases{
      {[](spidar_state_t& s) { s.protocol_version = 2; }, "version"},
      {[](spidar_state_t& s) { s.device_id.clear(); }, "device_id"},
      {[](spidar_state_t& s) { s.device_id.assign(1, '\xff'); }, "device_id"},
      {[](spidar_state_t& s) { s.sequence = 0; }, "sequence"},
      {[](spidar_state_t& s) { s.kind = 3; }, "kind 3"},
      {[](spidar_state_t& s) { s.kind = -1; }, "kind -1"},
      {[](spidar_state_t& s) { s.grip = 1.5; }, "grip"},
      {[](spidar_state_t& s) { s.grip = kNan; }, "grip"},
      {[](spidar_state_t& s) { s.position[2] = kInfinity; }, "position"},
      {[](spidar_state_t& s) { s.rotation[0] = 0.6; }, "rotation"},
      {[](spidar_state_t& s) { s.kind = kSpidarLengths, s.lengths[3] = kNan; }, "length"},
      {[](spidar_state_t& s) { s.kind = kSpidarLengths, s.lengths[3] = 101.0; }, "length"},
  };
  for (const auto& [change, word] : cases) {
    spidar_state_t state = testing::sample_spidar_state();
    change(state);
    const Decoded<spidar_state_t> decoded = decode_spidar_state(encode(state));
    EXPECT_FALSE(decoded.message) << word;
    EXPECT_NE(decoded.problem.find(word), std::string::npos) << decoded.problem;
  }
}

TEST(DecodeSpidarState, NumbersThatDoNotHold_AreNotJudged) {
  spidar_state_t state = testing::sample_spidar_state();
  state.lengths[0] = kNan;
  EXPECT_TRUE(decode_spidar_state(encode(state)).message) << "it is a pose";
  state.kind = kSpidarRejected;
  state.position[0] = kNan;
  EXPECT_TRUE(decode_spidar_state(encode(state)).message);
}

TEST(DecodeSpidarState, CutOrTooLong_Refused) {
  Bytes bytes = encode(testing::sample_spidar_state());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(decode_spidar_state(ByteView(bytes).first(size)).message) << size;
  }
  bytes.push_back(0);
  EXPECT_FALSE(decode_spidar_state(bytes).message);
}

TEST(DecodeSpidarState, RandomBytesAfterTheFingerprint_NeverThrowsAndWhatHoldsIsFit) {
  const Bytes good = encode(testing::sample_spidar_state());
  std::mt19937 random(20261123);
  int accepted = 0;
  for (int round = 0; round < 20000; ++round) {
    Bytes bytes = good;
    for (int change = 0; change < 2; ++change) {
      bytes[8 + random() % (bytes.size() - 8)] = static_cast<std::uint8_t>(random());
    }
    Decoded<spidar_state_t> decoded;
    ASSERT_NO_THROW(decoded = decode_spidar_state(bytes)) << "round " << round;
    if (!decoded.message || decoded.message->kind != kSpidarPose) continue;
    ++accepted;
    for (const double x : decoded.message->position) ASSERT_LE(std::abs(x), 1e6) << "round " << round;
  }
  EXPECT_GT(accepted, 1000);
}

TEST(DecodePointer, OutOfRange_RefusedWithTheReason) {
  const std::vector<std::pair<std::function<void(pointer_t&)>, std::string>> cases{
      {[](pointer_t& p) { p.protocol_version = 2; }, "version"},
      {[](pointer_t& p) { p.pointer = -1; }, "pointer -1"},
      {[](pointer_t& p) { p.pointer = kMaxPointers; }, "pointer 16"},
      {[](pointer_t& p) { p.position[1] = kNan; }, "position"},
      {[](pointer_t& p) { p.position[0] = -kInfinity; }, "position"},
      {[](pointer_t& p) { p.position[2] = 1.1e6; }, "position"},
      {[](pointer_t& p) { p.rotation[0] = kNan; }, "rotation"},
      {[](pointer_t& p) { p.rotation[0] = 0.6; }, "rotation"},
      {[](pointer_t& p) { std::ranges::fill(p.rotation, 0.0); }, "rotation"},
      {[](pointer_t& p) { p.rotation[3] = 1e300; }, "rotation"},
      {[](pointer_t& p) { p.client_id.clear(); }, "client_id"},
      {[](pointer_t& p) { p.client_id.push_back('\n'); }, "client_id"},
      {[](pointer_t& p) { p.client_id.assign(1, '\xff'); }, "client_id"},
      {[](pointer_t& p) { p.sequence = 0; }, "sequence"},
  };
  for (const auto& [change, word] : cases) {
    const Decoded<pointer_t> decoded = decode_pointer(encode(pointer_with(change)));
    EXPECT_FALSE(decoded.message) << word;
    EXPECT_NE(decoded.problem.find(word), std::string::npos) << decoded.problem;
  }
}

TEST(DecodePointer, SinglePrecisionQuaternion_Accepted) {
  const pointer_t pointer = pointer_with([](pointer_t& p) { p.rotation[0] = 0.5000001; });
  EXPECT_TRUE(decode_pointer(encode(pointer)).message);
}

TEST(DecodeCommand, Sample_GivesTheFieldsBack) {
  const Decoded<command_t> decoded = decode_command(encode(sample_command()));
  ASSERT_TRUE(decoded.message) << decoded.problem;
  EXPECT_EQ(decoded.message->name, "grab");
  ASSERT_EQ(decoded.message->arguments.size(), 2U);
  EXPECT_EQ(decoded.message->arguments[0].text, "H\u00fcfte.L");
  EXPECT_EQ(decoded.message->arguments[1].values, (std::vector<double>{0.5, -0.25, 1e-3}));
}

TEST(DecodeCommand, OtherVersion_LeftToBeAnswered) {
  command_t command = sample_command();
  command.protocol_version = 2;
  EXPECT_TRUE(decode_command(encode(command)).message);
}

TEST(DecodeCommand, EveryTruncation_Refused) {
  const Bytes bytes = encode(sample_command());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(decode_command(ByteView(bytes).first(size)).message) << size;
  }
}

TEST(DecodeCommand, BytesLeftOver_Refused) {
  Bytes bytes = encode(sample_command());
  bytes.push_back(0);
  EXPECT_FALSE(decode_command(bytes).message);
}

TEST(DecodeCommand, OtherType_Refused) {
  EXPECT_FALSE(decode_command(encode(sample_pointer())).message);
  EXPECT_FALSE(decode_pointer(encode(sample_command())).message);
}

TEST(DecodeCommand, HostileLengths_RefusedWithoutReservingThem) {
  const Bytes good = encode(sample_command());
  for (std::size_t at = 8; at + 4 <= good.size(); ++at) {
    for (const int lead : {0x7f, 0x80, 0xff}) {
      Bytes bytes = good;
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), 4, static_cast<std::uint8_t>(lead));
      EXPECT_NO_THROW(static_cast<void>(decode_command(bytes))) << at;
    }
  }
}

TEST(DecodeCommand, RandomBytesAfterTheFingerprint_NeverThrows) {
  const Bytes good = encode(sample_command());
  std::mt19937 random(20261122);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int round = 0; round < 20000; ++round) {
    Bytes bytes = good;
    for (int change = 0; change < 3; ++change) {
      const std::size_t at = 8 + random() % (bytes.size() - 8);
      bytes[at] = static_cast<std::uint8_t>(byte(random));
    }
    ASSERT_NO_THROW(static_cast<void>(decode_command(bytes))) << "round " << round;
  }
}

TEST(DecodeCommand, MoreBytesThanACommandMayHave_RefusedTellingTheLimit) {
  command_t command = testing::make_command(1, "set");
  for (int i = 0; i < 3; ++i) {
    testing::add_argument(command, testing::number_argument(std::to_string(i), std::vector<double>(65'000)));
  }
  const Decoded<command_t> decoded = decode_command(encode(command));
  EXPECT_FALSE(decoded.message);
  EXPECT_NE(decoded.problem.find("at most 1048576"), std::string::npos) << decoded.problem;
}

TEST(DecodeCommand, TooManyArguments_Refused) {
  command_t command = sample_command();
  for (int i = 0; i < 65; ++i) testing::add_argument(command, testing::number_argument(std::to_string(i), {1.0}));
  EXPECT_FALSE(decode_command(encode(command)).message);
}

TEST(DecodeCommand, TextThatIsNotUtf8_Refused) {
  command_t command = sample_command();
  command.arguments[0].text = "\xed\xa0\x80";  // a surrogate
  EXPECT_FALSE(decode_command(encode(command)).message);
  command = sample_command();
  command.name = "grab\t";
  EXPECT_FALSE(decode_command(encode(command)).message);
}

TEST(DecodeHeartbeat, Sample_TellsWhoSpeaksAndWhetherItLeaves) {
  status_t status = testing::sample_status();
  Decoded<Heartbeat> decoded = decode_heartbeat(encode(status));
  ASSERT_TRUE(decoded.message) << decoded.problem;
  EXPECT_EQ(decoded.message->server_id, status.server_id);
  EXPECT_FALSE(decoded.message->leaving);
  status.state = "leaving";
  decoded = decode_heartbeat(encode(status));
  ASSERT_TRUE(decoded.message) << decoded.problem;
  EXPECT_TRUE(decoded.message->leaving);
}

TEST(DecodeHeartbeat, OtherVersionOrType_RefusedWithTheReason) {
  status_t status = testing::sample_status();
  status.protocol_version = 2;
  EXPECT_EQ(decode_heartbeat(encode(status)).problem, "protocol version 2, this server speaks 1");
  for (const Bytes& bytes : {encode(sample_pointer()), Bytes{}, Bytes(200, 0xff)}) {
    const Decoded<Heartbeat> decoded = decode_heartbeat(bytes);
    EXPECT_FALSE(decoded.message);
    EXPECT_EQ(decoded.problem, "not a layfigure.status_t of protocol version 1");
  }
}

TEST(DecodeHeartbeat, EveryTruncation_IsRefusedOrReadsTheBeginning) {
  const Bytes whole = encode(testing::sample_status());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Decoded<Heartbeat> decoded = decode_heartbeat(ByteView(whole).first(size));
    EXPECT_TRUE(!decoded.message || decoded.message->server_id == testing::sample_status().server_id) << size;
  }
}

TEST(PlainText, ValidUtf8_Accepted) {
  for (const char* text : {"", "bone", "H\u00fcfte", "\u9aa8", "\U0001f9b4", "mixamorig:LeftHand"}) {
    EXPECT_TRUE(is_plain_text(text)) << text;
  }
}

TEST(PlainText, ControlsOverlongAndCutOff_Refused) {
  for (const char* text : {"\n", "\x7f", "\xc2\x85", "\xc0\x80", "\xe0\x80\x80", "\xf0\x80\x80\x80", "\xf4\x90\x80\x80",
                           "\xf5\x80\x80\x80", "\xe9\xaa", "\x80", "a\xc3"}) {
    EXPECT_FALSE(is_plain_text(text)) << text;
  }
}

}  // namespace
}  // namespace layfigure::messaging
