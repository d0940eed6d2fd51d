#include "layfigure/haptics/realtime_thread.h"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <utility>

namespace layfigure::haptics {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr double kLeastRate = 1.0;
constexpr double kMostRate = 100'000.0;

void sleep_until(std::int64_t ns) noexcept {
  const timespec until{.tv_sec = ns / kSecond, .tv_nsec = ns % kSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

/// Under a limit, locking what is there may be allowed, and a later allocation be refused for it.
bool may_lock_all() noexcept {
  rlimit limit{};
  return geteuid() == 0 || (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
}

}  // namespace

std::int64_t now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

RealtimeGrant request_realtime(int priority) {
  RealtimeGrant grant;
  sched_param parameters{};
  parameters.sched_priority = priority;
  const int refusal = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  grant.scheduled = refusal == 0;
  if (!grant.scheduled) {
    grant.refused = "real-time scheduling (SCHED_FIFO " + std::to_string(priority) + "): " + std::strerror(refusal) +
                    "; allow it by 'rtprio' in /etc/security/limits.conf or CAP_SYS_NICE";
  }
  errno = EPERM;
  grant.memory_locked = may_lock_all() && mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  if (!grant.memory_locked) {
    const std::string why = std::strerror(errno);
    grant.refused += (grant.refused.empty() ? "" : "; ");
    grant.refused +=
        "locked memory (mlockall): " + why + "; allow it by 'memlock' in /etc/security/limits.conf or CAP_IPC_LOCK";
  }
  return grant;
}

TickTimes::TickTimes(double rate_hz, std::int64_t start_ns) : due_ns_(start_ns) {
  if (!(rate_hz >= kLeastRate && rate_hz <= kMostRate)) {
    throw std::invalid_argument("rate = " + std::to_string(rate_hz) + " Hz, expected 1 to 100000");
  }
  period_ns_ = std::llround(static_cast<double>(kSecond) / rate_hz);
}

std::uint64_t TickTimes::begin(std::int64_t now) noexcept {
  const std::int64_t delay = std::max<std::int64_t>(now - due_ns_, 0);
  const std::int64_t dropped = delay / period_ns_;
  ++statistics_.ticks;
  if (dropped > 0) ++statistics_.late;
  statistics_.skipped += static_cast<std::uint64_t>(dropped);
  statistics_.worst_delay = std::max(statistics_.worst_delay, static_cast<double>(delay) * 1e-9);
  due_ns_ += (dropped + 1) * period_ns_;
  return static_cast<std::uint64_t>(dropped);
}

RealtimeThread::RealtimeThread(double rate_hz, std::function<void(double)> tick) {
  const TickTimes times(rate_hz, now_ns());
  thread_ = std::thread([this, times, tick = std::move(tick)] { run(times, tick); });
  granted_.wait(false, std::memory_order_acquire);
}

RealtimeThread::~RealtimeThread() {
  stopping_.store(true, std::memory_order_relaxed);
  thread_.join();
}

void RealtimeThread::run(TickTimes times, const std::function<void(double)>& tick) {
  grant_ = request_realtime(kPriority);
  granted_.store(true, std::memory_order_release);
  granted_.notify_all();
  while (!stopping_.load(std::memory_order_relaxed)) {
    sleep_until(times.due_ns());
    const std::uint64_t dropped = times.begin(now_ns());
    tick(static_cast<double>(dropped + 1) * times.period());
    const TickStatistics& so_far = times.statistics();
    ticks_.store(so_far.ticks, std::memory_order_relaxed);
    late_.store(so_far.late, std::memory_order_relaxed);
    skipped_.store(so_far.skipped, std::memory_order_relaxed);
    worst_delay_.store(so_far.worst_delay, std::memory_order_relaxed);
  }
}

TickStatistics RealtimeThread::statistics() const noexcept {
  return {.ticks = ticks_.load(std::memory_order_relaxed),
          .late = late_.load(std::memory_order_relaxed),
          .skipped = skipped_.load(std::memory_order_relaxed),
          .worst_delay = worst_delay_.load(std::memory_order_relaxed)};
}

}  // namespace layfigure::haptics
