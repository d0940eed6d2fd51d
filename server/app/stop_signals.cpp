#include "layfigure/app/stop_signals.h"

#include <poll.h>
#include <pthread.h>
#include <time.h>
#include <unistd.h>

#include <utility>

namespace layfigure::app {
namespace {

bool input_has_ended() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (poll(&input, 1, 0) > 0) {
    char sink[256];
    if (read(STDIN_FILENO, sink, sizeof sink) <= 0) return true;
  }
  return false;
}

}  // namespace

StopSignals::StopSignals(bool ends_with_input) : ends_with_input_(ends_with_input) {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  signal(SIGPIPE, SIG_IGN);
}

std::jthread StopSignals::watch(std::function<void()> stop) const {
  return std::jthread([*this, stop = std::move(stop)](const std::stop_token& token) {
    const timespec interval{0, 50'000'000};
    while (!token.stop_requested()) {
      const bool is_signalled = sigtimedwait(&signals_, nullptr, &interval) > 0;
      if (is_signalled || (ends_with_input_ && input_has_ended())) stop();
    }
  });
}

}  // namespace layfigure::app
