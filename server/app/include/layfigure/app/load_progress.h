#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace layfigure::app {

/// Says on a terminal what takes so long: one line that names the stage and the seconds since the beginning, drawn anew
/// once a second from the first second on, wiped out in the end. A file or a pipe gets nothing.
class LoadProgress {
 public:
  static constexpr std::chrono::milliseconds kInterval{1000};

  /// `terminal`: a file descriptor; without a terminal behind it, nothing happens.
  explicit LoadProgress(int terminal, std::chrono::milliseconds interval = kInterval);
  ~LoadProgress();
  LoadProgress(const LoadProgress&) = delete;
  LoadProgress& operator=(const LoadProgress&) = delete;

  /// What is being done from now on, as in "reading doll.glb".
  void stage(std::string name);

 private:
  void run();
  void draw(const std::string& text) const;

  int terminal_;
  std::chrono::milliseconds interval_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string stage_;
  bool finished_{false};
  std::thread thread_;
};

}  // namespace layfigure::app
