#include "layfigure/device/latest_value.h"

#include <gtest/gtest.h>

#include <thread>

namespace layfigure::device {
namespace {

/// Large enough that a copy that is overtaken would show.
struct Message {
  std::array<std::uint64_t, 64> parts;
};

Message message(std::uint64_t number) {
  Message made;
  made.parts.fill(number);
  return made;
}

TEST(LatestValue, NothingWritten_ReadsNothing) {
  LatestValue<int> slot;
  int value = 7;
  EXPECT_FALSE(slot.read(value));
  EXPECT_EQ(value, 7);
}

TEST(LatestValue, WrittenTwice_ReadsTheNewestOnce) {
  LatestValue<int> slot;
  slot.write(1);
  slot.write(2);
  int value = 0;
  ASSERT_TRUE(slot.read(value));
  EXPECT_EQ(value, 2);
  EXPECT_FALSE(slot.read(value));
  slot.write(3);
  ASSERT_TRUE(slot.read(value));
  EXPECT_EQ(value, 3);
}

TEST(LatestValue, TwoThreads_ValuesAreWholeAndRise) {
  constexpr std::uint64_t kMessages = 200'000;
  LatestValue<Message> slot;
  std::thread writer([&slot] {
    for (std::uint64_t k = 1; k <= kMessages; ++k) slot.write(message(k));
  });
  std::uint64_t last = 0;
  Message seen = message(0);
  while (last < kMessages) {
    if (!slot.read(seen)) continue;
    ASSERT_GT(seen.parts[0], last);
    last = seen.parts[0];
    for (const std::uint64_t part : seen.parts) ASSERT_EQ(part, last) << "torn";
  }
  writer.join();
}

}  // namespace
}  // namespace layfigure::device
