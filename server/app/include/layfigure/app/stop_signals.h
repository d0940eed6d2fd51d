#pragma once

#include <signal.h>

#include <functional>
#include <thread>

namespace layfigure::app {

/// SIGINT and SIGTERM as wishes to stop. From its making on they interrupt neither this thread nor those that it starts
/// then; watch() waits for them. A client that has gone is an error of its own socket only, and not SIGPIPE.
class StopSignals {
 public:
  /// `ends_with_input`: the end of standard input is such a wish, too; what stands there is read and left out.
  explicit StopSignals(bool ends_with_input);

  /// Calls `stop`, on a thread of its own, each time that one of them comes, until the thread is asked to stop.
  [[nodiscard]] std::jthread watch(std::function<void()> stop) const;

 private:
  sigset_t signals_{};
  bool ends_with_input_;
};

}  // namespace layfigure::app
