// The bytes of one message of each type, kept in tests/data/golden, are what both C++ and Python must write and read.
// After a wanted change of a type, run this with LAYFIGURE_WRITE_GOLDEN=1 in the environment to write them anew.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "layfigure/messaging/codec.h"
#include "sample_messages.h"

namespace layfigure::messaging {
namespace {

template <class Message>
std::string golden_path() {
  return std::string(GOLDEN_DIR) + "/" + Message::getTypeName() + ".bin";
}

Bytes read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void write_file(const std::string& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

template <class Message>
void expect_golden(const Message& message) {
  const Bytes encoded = encode(message);
  if (std::getenv("LAYFIGURE_WRITE_GOLDEN") != nullptr) write_file(golden_path<Message>(), encoded);
  const Bytes golden = read_file(golden_path<Message>());
  EXPECT_EQ(encoded, golden) << golden_path<Message>();
  Message decoded{};
  EXPECT_EQ(decoded.decode(golden.data(), 0, static_cast<int>(golden.size())), static_cast<int>(golden.size()));
  EXPECT_EQ(encode(decoded), golden);
}

TEST(GoldenBytes, OfEachType_EncodedAndDecoded) {
  expect_golden(testing::sample_character());
  expect_golden(testing::sample_command());
  expect_golden(testing::sample_force());
  expect_golden(testing::sample_log_devices());
  expect_golden(testing::sample_log_snapshot());
  expect_golden(testing::sample_log_start());
  expect_golden(testing::sample_log_step());
  expect_golden(testing::sample_mesh_chunk());
  expect_golden(testing::sample_meshes());
  expect_golden(testing::sample_pointer());
  expect_golden(testing::sample_pose());
  expect_golden(testing::sample_reply());
  expect_golden(testing::sample_spidar_command());
  expect_golden(testing::sample_spidar_state());
  expect_golden(testing::sample_status());
}

TEST(GoldenBytes, OfAPose_HaveTheDocumentedLayout) {
  const Bytes golden = read_file(golden_path<pose_t>());
  const auto joints = static_cast<std::size_t>(testing::sample_pose().joint_count);
  // fingerprint, version, time, server, hash, sequence, step, root, count, then 64 + 12 + 1 bytes a joint
  EXPECT_EQ(golden.size(), 8 + 4 + 5 * 8 + 3 * 8 + 4 + joints * (32 + 32 + 12 + 1));
}

}  // namespace
}  // namespace layfigure::messaging
