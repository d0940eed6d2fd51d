#include "byte_ring.h"

#include <gtest/gtest.h>

#include <random>
#include <thread>

namespace layfigure::messaging {
namespace {

Bytes bytes(std::size_t count, int first) {
  Bytes result(count);
  for (std::size_t k = 0; k < count; ++k) result[k] = static_cast<std::uint8_t>(first + static_cast<int>(k));
  return result;
}

Bytes taken(ByteRing& ring) {
  Bytes out;
  ring.take(out);
  return out;
}

TEST(ByteRing, Pieces_ComeOutInTheirOrder) {
  ByteRing ring(16);
  ASSERT_TRUE(ring.put({bytes(3, 1), bytes(2, 4)}));
  ASSERT_TRUE(ring.put({bytes(1, 6)}));
  EXPECT_EQ(taken(ring), bytes(6, 1));
  EXPECT_TRUE(taken(ring).empty());
}

TEST(ByteRing, Taken_IsAppended) {
  ByteRing ring(16);
  ASSERT_TRUE(ring.put({bytes(2, 3)}));
  Bytes out = bytes(2, 1);
  ring.take(out);
  EXPECT_EQ(out, bytes(4, 1));
}

TEST(ByteRing, WithoutRoomForAllPieces_TakesNone) {
  ByteRing ring(8);
  ASSERT_TRUE(ring.put({bytes(5, 1)}));
  EXPECT_FALSE(ring.put({bytes(2, 6), bytes(2, 8)}));
  EXPECT_FALSE(ring.put({bytes(9, 1)}));
  EXPECT_TRUE(ring.put({bytes(3, 6)})) << "to the last byte";
  EXPECT_FALSE(ring.put({bytes(1, 9)}));
  EXPECT_TRUE(ring.put({Bytes{}}));
  EXPECT_EQ(taken(ring), bytes(8, 1));
}

TEST(ByteRing, AroundItsEnd_KeepsTheBytes) {
  ByteRing ring(7);
  for (int round = 0; round < 50; ++round) {
    ASSERT_TRUE(ring.put({bytes(2, round), bytes(3, round + 2)}));
    ASSERT_EQ(taken(ring), bytes(5, round));
  }
}

TEST(ByteRing, TwoThreads_LoseAndMixNothing) {
  constexpr int kRecords = 200'000;
  ByteRing ring(1000);
  std::thread producer([&] {
    std::mt19937 random(1);
    for (int k = 0; k < kRecords; ++k) {
      const auto size = static_cast<std::uint8_t>(1 + random() % 40);
      const Bytes record(size, static_cast<std::uint8_t>(k));
      while (!ring.put({Bytes{size}, record})) std::this_thread::yield();
    }
  });
  Bytes out;
  int records = 0;
  while (records < kRecords) {
    out.clear();
    ring.take(out);
    for (std::size_t at = 0; at < out.size(); ++records) {
      const std::size_t size = out[at];
      ASSERT_LE(at + 1 + size, out.size()) << "record " << records << " was taken in part";
      for (std::size_t k = 1; k <= size; ++k) ASSERT_EQ(out[at + k], static_cast<std::uint8_t>(records));
      at += 1 + size;
    }
  }
  producer.join();
  EXPECT_TRUE(taken(ring).empty());
}

}  // namespace
}  // namespace layfigure::messaging
