#include "layfigure/messaging/send_queue.h"

#include <gtest/gtest.h>

namespace layfigure::messaging {
namespace {

constexpr SendLimits kLimits{.state = 100, .total = 200};

std::shared_ptr<const Frame> frame(const std::string& name, std::size_t size, bool is_state) {
  return std::make_shared<Frame>(Frame{name, Bytes(size), is_state});
}

std::string drain(SendQueue& queue) {
  std::string names;
  while (const auto next = queue.pop()) names += next->channel;
  return names;
}

TEST(SendQueue, BelowTheBound_KeepsEverythingInOrder) {
  SendQueue queue(kLimits);
  for (const char* name : {"a", "b", "c", "d"}) ASSERT_TRUE(queue.push(frame(name, 25, true)));
  EXPECT_EQ(queue.bytes(), 100U);
  EXPECT_EQ(drain(queue), "abcd");
  EXPECT_EQ(queue.dropped(), 0);
  EXPECT_EQ(queue.bytes(), 0U);
}

TEST(SendQueue, StateOverTheBound_DropsTheOldestState) {
  SendQueue queue(kLimits);
  ASSERT_TRUE(queue.push(frame("C", 30, false)));
  for (const char* name : {"a", "b", "c", "d"}) ASSERT_TRUE(queue.push(frame(name, 30, true)));
  EXPECT_EQ(drain(queue), "Ccd");
  EXPECT_EQ(queue.dropped(), 2);
}

TEST(SendQueue, OthersOverTheBound_DisplaceStateOnly) {
  SendQueue queue(kLimits);
  ASSERT_TRUE(queue.push(frame("s", 50, true)));
  for (const char* name : {"A", "B", "C", "D"}) ASSERT_TRUE(queue.push(frame(name, 50, false)));
  EXPECT_EQ(drain(queue), "ABCD");
  EXPECT_EQ(queue.dropped(), 1);
}

TEST(SendQueue, OthersOverTheTotal_Overflows) {
  SendQueue queue(kLimits);
  for (const char* name : {"A", "B", "C", "D"}) ASSERT_TRUE(queue.push(frame(name, 50, false)));
  EXPECT_FALSE(queue.push(frame("E", 1, false)));
  EXPECT_EQ(drain(queue), "ABCD");
}

TEST(SendQueue, Empty_PopsNull) {
  SendQueue queue;
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.pop(), nullptr);
}

}  // namespace
}  // namespace layfigure::messaging
