#include "crew.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <thread>

namespace layfigure::dynamics {
namespace {

constexpr int kHelpers = 3;

TEST(Crew, ManyJobs_EveryPartIsDoneOnceAndSeen) {
  Crew crew(kHelpers);
  std::array<long, kHelpers + 1> done{};
  std::array<long, kHelpers + 1> expected{};
  for (int job = 0; job < 20000; ++job) {
    const int parts = 1 + job % (kHelpers + 1);
    crew.run(parts, [&](int part) { done[part] += job; });
    for (int part = 0; part < parts; ++part) expected[part] += job;
    ASSERT_EQ(done, expected) << "job " << job;
  }
}

TEST(Crew, HelpersThatSleep_AreWoken) {
  Crew crew(kHelpers);
  std::array<int, kHelpers + 1> done{};
  for (int job = 1; job <= 5; ++job) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    crew.run(kHelpers + 1, [&](int part) { ++done[part]; });
    for (const int times : done) EXPECT_EQ(times, job);
  }
}

TEST(Crew, PartZero_IsTheCallers) {
  Crew crew(1);
  std::thread::id caller;
  for (int job = 0; job < 100; ++job) {
    crew.run(2, [&](int part) {
      if (part == 0) caller = std::this_thread::get_id();
    });
    ASSERT_EQ(caller, std::this_thread::get_id());
  }
}

TEST(Crew, LongParts_GoOnAtTheSameTime) {
  Crew crew(1);
  std::atomic<int> there{0};
  // Each waits for the other: only two threads get through. The caller's lasts until the helper has begun.
  crew.run(2, [&](int) {
    ++there;
    while (there < 2) std::this_thread::yield();
  });
  EXPECT_EQ(there, 2);
}

TEST(Crew, WithoutHelpers_CallsThePart) {
  Crew crew(0);
  int parts = 0;
  crew.run(1, [&](int part) { parts += 1 + part; });
  EXPECT_EQ(parts, 1);
}

}  // namespace
}  // namespace layfigure::dynamics
