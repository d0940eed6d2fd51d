#include "layfigure/app/reply_cache.h"

#include <gtest/gtest.h>

namespace layfigure::app {
namespace {

reply_t reply(const std::string& client, std::int64_t sequence) {
  reply_t message{};
  message.client_id = client;
  message.sequence = sequence;
  message.reason = client + " " + std::to_string(sequence);
  return message;
}

TEST(ReplyCache, StoredReply_IsFoundForItsClientOnly) {
  ReplyCache cache;
  cache.store(reply("a", 1));
  ASSERT_NE(cache.find("a", 1), nullptr);
  EXPECT_EQ(cache.find("a", 1)->reason, "a 1");
  EXPECT_EQ(cache.find("a", 2), nullptr);
  EXPECT_EQ(cache.find("b", 1), nullptr);
}

TEST(ReplyCache, ManyReplies_ForgetsTheOldestAndKnowsIt) {
  ReplyCache cache;
  const auto kept = static_cast<std::int64_t>(ReplyCache::kRepliesPerClient);
  for (std::int64_t sequence = 1; sequence <= kept + 10; ++sequence) cache.store(reply("a", sequence));
  EXPECT_EQ(cache.find("a", 10), nullptr);
  EXPECT_TRUE(cache.is_too_old("a", 10));
  EXPECT_NE(cache.find("a", 11), nullptr);
  EXPECT_FALSE(cache.is_too_old("a", 11));
  EXPECT_FALSE(cache.is_too_old("b", 1));
}

TEST(ReplyCache, ManyClients_ForgetsTheOneSilentLongest) {
  ReplyCache cache;
  for (std::size_t i = 0; i < ReplyCache::kClients; ++i) cache.store(reply("c" + std::to_string(i), 1));
  cache.store(reply("c0", 2));
  cache.store(reply("new", 1));
  EXPECT_NE(cache.find("c0", 1), nullptr);
  EXPECT_EQ(cache.find("c1", 1), nullptr);
  EXPECT_NE(cache.find("new", 1), nullptr);
}

}  // namespace
}  // namespace layfigure::app
