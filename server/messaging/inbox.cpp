#include "layfigure/messaging/inbox.h"

#include <spdlog/spdlog.h>

#include <utility>

namespace layfigure::messaging {
namespace {

constexpr std::size_t kMaxEvents = 65536;  // a client that sends faster than this drains is not waiting for answers
constexpr std::chrono::seconds kLogInterval{1};

/// The waiting message that `pointer` may replace: of the same pointer, with no command after it.
pointer_t* find_replaceable(std::deque<Inbox::Event>& events, int pointer) {
  for (auto event = events.rbegin(); event != events.rend(); ++event) {
    auto* waiting = std::get_if<pointer_t>(&*event);
    if (waiting == nullptr || waiting->pointer == pointer) return waiting;
  }
  return nullptr;
}

}  // namespace

void Inbox::receive_pointer(ByteView bytes) {
  Decoded<pointer_t> decoded = decode_pointer(bytes);
  if (!decoded.message) return refuse("pointer", decoded.problem);
  {
    const std::lock_guard lock(mutex_);
    if (pointer_t* waiting = find_replaceable(events_, decoded.message->pointer)) {
      const bool stale =
          waiting->client_id == decoded.message->client_id && waiting->sequence > decoded.message->sequence;
      if (!stale) *waiting = std::move(*decoded.message);
    } else {
      events_.emplace_back(std::move(*decoded.message));
    }
  }
  changed_.notify_one();
}

void Inbox::receive_command(ByteView bytes) {
  Decoded<command_t> decoded = decode_command(bytes);
  if (!decoded.message) return refuse("command", decoded.problem);
  {
    const std::unique_lock lock(mutex_);
    if (events_.size() < kMaxEvents) {
      events_.emplace_back(std::move(*decoded.message));
    } else {
      decoded.problem = "more than " + std::to_string(kMaxEvents) + " commands are waiting";
    }
  }
  if (!decoded.problem.empty()) return refuse("command", decoded.problem);
  changed_.notify_one();
}

std::vector<Inbox::Event> Inbox::take() {
  std::deque<Event> events;
  {
    const std::lock_guard lock(mutex_);
    events.swap(events_);
  }
  return {std::make_move_iterator(events.begin()), std::make_move_iterator(events.end())};
}

void Inbox::wait_until(Clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, deadline, [&] { return !events_.empty() || interrupted_; });
  interrupted_ = false;
}

void Inbox::interrupt() {
  {
    const std::lock_guard lock(mutex_);
    interrupted_ = true;
  }
  changed_.notify_one();
}

void Inbox::refuse(std::string_view kind, const std::string& problem) {
  const std::int64_t count = ++bad_messages_;
  const std::lock_guard lock(mutex_);
  if (Clock::now() < next_log_) return;
  next_log_ = Clock::now() + kLogInterval;
  spdlog::warn("refused a {} message: {} ({} bad messages so far)", kind, problem, count);
}

}  // namespace layfigure::messaging
