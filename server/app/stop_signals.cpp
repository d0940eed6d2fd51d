#include "layfigure/app/stop_signals.h"

#include <pthread.h>
#include <time.h>

#include <utility>

namespace layfigure::app {

StopSignals::StopSignals() {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  signal(SIGPIPE, SIG_IGN);
}

std::jthread StopSignals::watch(std::function<void()> stop) const {
  return std::jthread([signals = signals_, stop = std::move(stop)](const std::stop_token& token) {
    const timespec interval{0, 50'000'000};
    while (!token.stop_requested()) {
      if (sigtimedwait(&signals, nullptr, &interval) > 0) stop();
    }
  });
}

}  // namespace layfigure::app
