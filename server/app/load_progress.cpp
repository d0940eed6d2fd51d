#include "layfigure/app/load_progress.h"

#include <unistd.h>

#include <utility>

namespace layfigure::app {
namespace {

constexpr const char* kStartOfLine = "\r\033[K";  // and wipe it

}  // namespace

LoadProgress::LoadProgress(int terminal, std::chrono::milliseconds interval)
    : terminal_(terminal), interval_(interval) {
  if (::isatty(terminal_) != 0) thread_ = std::thread(&LoadProgress::run, this);
}

LoadProgress::~LoadProgress() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    finished_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void LoadProgress::stage(std::string name) {
  const std::lock_guard lock(mutex_);
  stage_ = std::move(name);
}

void LoadProgress::run() {
  const auto start = std::chrono::steady_clock::now();
  bool drawn = false;
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, interval_, [this] { return finished_; })) {
    const auto elapsed = std::chrono::duration_cast<std::chrono::seconds>(std::chrono::steady_clock::now() - start);
    draw(stage_ + ", " + std::to_string(elapsed.count()) + " s");
    drawn = true;
  }
  if (drawn) draw("");
}

void LoadProgress::draw(const std::string& text) const {
  const std::string line = kStartOfLine + text;
  // A terminal that has gone is no reason not to load.
  [[maybe_unused]] const ssize_t written = ::write(terminal_, line.data(), line.size());
}

}  // namespace layfigure::app
