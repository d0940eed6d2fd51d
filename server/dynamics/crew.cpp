#include "crew.h"

#include <pthread.h>
#include <signal.h>

namespace layfigure::dynamics {
namespace {

// How often a thread that waits looks before it sleeps. Each look lets others have the processor: some 0.1 ms in all
// where nobody wants it, which is longer than the steps of a doll, at most, and a hundred times what waking takes.
constexpr int kLooks = 300;

/// Returns when the value is no longer `old`.
void await_change(const std::atomic<int>& value, int old) {
  for (int k = 0; k < kLooks; ++k) {
    if (value.load(std::memory_order_acquire) != old) return;
    std::this_thread::yield();
  }
  value.wait(old, std::memory_order_acquire);
}

/// Blocks all signals of this thread, and of those that it starts meanwhile.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_{};
};

}  // namespace

Crew::Crew(int helpers) : helpers_(helpers) {
  const SignalsBlocked blocked;
  try {
    for (int part = 1; part <= helpers; ++part) helpers_[part - 1].thread = std::thread(&Crew::help, this, part);
  } catch (...) {
    dismiss();
    throw;
  }
}

Crew::~Crew() { dismiss(); }

void Crew::dismiss() {
  for (Helper& helper : helpers_) {
    if (!helper.thread.joinable()) continue;
    helper.progress.store(kOver, std::memory_order_release);
    helper.progress.notify_one();
    helper.thread.join();
  }
}

void Crew::offer(int parts) {
  for (int part = 1; part < parts; ++part) {
    progress_of(part).store(kOffered, std::memory_order_release);
    progress_of(part).notify_one();
  }
}

void Crew::finish(int parts) {
  for (int part = 1; part < parts; ++part) {
    std::atomic<int>& progress = progress_of(part);
    int offered = kOffered;
    if (progress.compare_exchange_strong(offered, kDone, std::memory_order_relaxed)) call_(job_, part);
  }
  for (int part = 1; part < parts; ++part) await_change(progress_of(part), kBegun);
}

void Crew::help(int part) {
  std::atomic<int>& progress = progress_of(part);
  while (true) {
    int now = progress.load(std::memory_order_acquire);
    if (now == kOver) return;
    if (now == kOffered && progress.compare_exchange_strong(now, kBegun, std::memory_order_acquire)) {
      call_(job_, part);
      progress.store(kDone, std::memory_order_release);
      progress.notify_one();
      continue;
    }
    if (now != kOffered) await_change(progress, now);
  }
}

}  // namespace layfigure::dynamics
