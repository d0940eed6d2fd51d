#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "layfigure/messaging/codec.h"

/// LCM event logs (.lcmlog): what lcm-logger writes and lcm-logplayer plays.
namespace layfigure::messaging {

/// A log that cannot be opened. what() is one line with the file and the mend.
class LogError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct LogEvent {
  std::string channel;
  Bytes bytes;
};

/// Writes a log on a thread of its own, so that the disk delays nobody. What was written up to about a second ago
/// outlives a kill of the process.
class EventLogWriter {
 public:
  /// How much may wait for the disk [bytes]: at 1 MB/s some minutes.
  static constexpr std::size_t kMostWaiting = 256U << 20;

  /// A new log at `path`; an earlier file of that name is replaced, unless somebody is writing it. Throws LogError.
  explicit EventLogWriter(const std::filesystem::path& path);
  /// Writes what waits.
  ~EventLogWriter();
  EventLogWriter(const EventLogWriter&) = delete;
  EventLogWriter& operator=(const EventLogWriter&) = delete;

  /// Queues an event, with the present wall-clock time. Where the disk is full, or so slow that kMostWaiting is not
  /// enough, the log ends, one line says so, and this does nothing any more. Thread-safe; allocates.
  void write(std::string_view channel, ByteView bytes);

  /// The same where neither an allocation nor a lock may be: the event is copied into memory that is there. Only if the
  /// disk has let that be filled, which takes it a second and more, this is as write(). For one thread; its events, by
  /// either of the two, keep their order.
  void write_from_step(std::string_view channel, ByteView bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads a log.
class EventLogReader {
 public:
  /// Throws LogError.
  explicit EventLogReader(const std::filesystem::path& path);
  ~EventLogReader();
  EventLogReader(const EventLogReader&) = delete;
  EventLogReader& operator=(const EventLogReader&) = delete;

  /// The next event; nothing at the end, or where the log was cut off.
  [[nodiscard]] std::optional<LogEvent> next();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace layfigure::messaging
