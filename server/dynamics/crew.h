#pragma once

#include <atomic>
#include <thread>
#include <vector>

namespace layfigure::dynamics {

/// Threads that take parts of a job, so short that a lock or a thread of its own would cost more: a helper that has
/// done its part waits for the next one awake for a while before it sleeps. Signals go to other threads.
///
/// One job at a time. run() allocates nothing, takes no lock and throws nothing.
class Crew {
 public:
  /// Throws std::system_error where the system gives no more threads.
  explicit Crew(int helpers);
  ~Crew();
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  /// Calls job(0) .. job(parts - 1), each once, parts <= helpers + 1, and returns when all have returned. job(0) is
  /// called here, and so are the parts that no helper has begun by then. What the job wrote is there for the caller.
  template <class Job>
  void run(int parts, const Job& job) {
    call_ = [](const void* it, int part) { (*static_cast<const Job*>(it))(part); };
    job_ = &job;
    offer(parts);
    job(0);
    finish(parts);
  }

 private:
  enum Progress : int { kNone, kOffered, kBegun, kDone, kOver };

  /// On cache lines of its own: two threads look at it while others work.
  struct alignas(64) Helper {
    std::atomic<int> progress{kNone};  ///< of its part of the job
    std::thread thread;
  };

  void offer(int parts);
  void finish(int parts);
  void dismiss();
  void help(int part);
  [[nodiscard]] std::atomic<int>& progress_of(int part) { return helpers_[part - 1].progress; }

  void (*call_)(const void* job, int part){nullptr};
  const void* job_{nullptr};
  std::vector<Helper> helpers_;  ///< helper k does part k + 1
};

}  // namespace layfigure::dynamics
