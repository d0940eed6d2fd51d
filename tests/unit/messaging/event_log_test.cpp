#include "layfigure/messaging/event_log.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <vector>

#include "allocation_count.h"

namespace layfigure::messaging {
namespace {

namespace fs = std::filesystem;

class EventLog : public ::testing::Test {
 protected:
  ~EventLog() override { fs::remove(path_); }

  [[nodiscard]] std::vector<LogEvent> read() const {
    EventLogReader reader(path_);
    std::vector<LogEvent> events;
    while (std::optional<LogEvent> event = reader.next()) events.push_back(std::move(*event));
    return events;
  }

  const fs::path path_ = fs::temp_directory_path() / ("layfigure-event-log-" + std::to_string(getpid()) + ".lcmlog");
};

Bytes number(int value, std::size_t size = sizeof(int)) {
  Bytes bytes(size);
  std::copy_n(reinterpret_cast<const std::uint8_t*>(&value), sizeof value, bytes.begin());
  return bytes;
}

int value_of(const LogEvent& event) {
  int value = 0;
  std::copy_n(event.bytes.begin(), sizeof value, reinterpret_cast<std::uint8_t*>(&value));
  return value;
}

TEST_F(EventLog, EventsOfBothKinds_KeepTheirOrder) {
  constexpr int kEvents = 20'000;
  {
    EventLogWriter log(path_);
    for (int k = 0; k < kEvents; ++k) {
      if (k % 17 == 0) {
        log.write("FREELY", number(k));
      } else {
        log.write_from_step("FROM_STEP", number(k));
      }
    }
  }
  const std::vector<LogEvent> events = read();
  ASSERT_EQ(events.size(), kEvents);
  for (int k = 0; k < kEvents; ++k) {
    ASSERT_EQ(value_of(events[k]), k);
    ASSERT_EQ(events[k].channel, k % 17 == 0 ? "FREELY" : "FROM_STEP");
  }
}

TEST_F(EventLog, FromStep_MoreThanThereIsRoomFor_IsKeptWhole) {
  constexpr int kEvents = 100;
  constexpr std::size_t kLarge = 1U << 20;  // together more than what is there for steps
  {
    EventLogWriter log(path_);
    for (int k = 0; k < kEvents; ++k) log.write_from_step("LARGE", number(k, kLarge));
  }
  const std::vector<LogEvent> events = read();
  ASSERT_EQ(events.size(), kEvents);
  for (int k = 0; k < kEvents; ++k) {
    ASSERT_EQ(value_of(events[k]), k);
    ASSERT_EQ(events[k].bytes.size(), kLarge);
  }
}

TEST_F(EventLog, FromStep_AllocatesNothing) {
  EventLogWriter log(path_);
  const Bytes bytes(700);
  const long before = testing::thread_allocation_count();
  for (int k = 0; k < 10'000; ++k) log.write_from_step("FROM_STEP", bytes);
  EXPECT_EQ(testing::thread_allocation_count(), before);
}

TEST_F(EventLog, WrittenByAnother_RefusedNamingIt) {
  const EventLogWriter log(path_);
  try {
    const EventLogWriter second(path_);
    FAIL() << "two write one file";
  } catch (const LogError& error) {
    EXPECT_NE(std::string(error.what()).find(path_.string()), std::string::npos);
  }
}

}  // namespace
}  // namespace layfigure::messaging
