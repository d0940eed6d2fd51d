#pragma once

#include <cstdint>
#include <filesystem>
#include <layfigure/log_start_t.hpp>
#include <memory>
#include <stdexcept>
#include <string>

#include "layfigure/doll/doll.h"
#include "layfigure/messaging/event_log.h"

namespace layfigure::app {

/// A log that cannot be played again. what() is one line with the reason and the mend.
class ReplayError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ReplayReport {
  std::int64_t poses{0};   ///< that came out the same, bit for bit
  std::int64_t steps{0};   ///< done
  std::string difference;  ///< the first, one line; "": there was none
};

/// Plays a session's log (session_log.h) again. What it took in takes effect at the same steps, and each pose that it
/// published is compared with the one that comes out. A log that was cut off is played as far as it goes.
class Replay {
 public:
  /// Reads the log's beginning. Throws messaging::LogError, or ReplayError: it is no session's log, or one of another
  /// version of the program.
  explicit Replay(const std::filesystem::path& log);

  [[nodiscard]] const log_start_t& start() const { return start_; }
  /// The settings that the doll was made by. Throws ReplayError.
  [[nodiscard]] doll::DollSettings doll_settings() const;
  /// With a doll of the log's character and settings. Throws ReplayError: it is another one. Once.
  [[nodiscard]] ReplayReport run(doll::Doll doll);

 private:
  messaging::EventLogReader log_;
  std::string path_;
  std::string prefix_;
  log_start_t start_;
};

}  // namespace layfigure::app
