#include "layfigure/messaging/inbox.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "layfigure/messaging/protocol.h"

namespace layfigure::messaging {
namespace {

constexpr std::size_t kMaxEvents = 65536;  // a client that sends faster than this drains is not waiting for answers
constexpr std::size_t kMaxWaitingBytes = 64U << 20;  // holds kMaxEvents commands of the usual size many times over
constexpr std::size_t kMaxKnownClients = 256;        // beyond it all begin anew; what may wait bounds those who rename
constexpr std::chrono::seconds kLogInterval{1};
constexpr std::chrono::seconds kRivalSilence{1};  // ten heartbeats

}  // namespace

void Inbox::receive_pointer(ByteView bytes) {
  Decoded<pointer_t> decoded = decode_pointer(bytes);
  if (!decoded.message) return refuse("pointer", decoded.problem);
  if (is_for_another(decoded.message->server_id)) return;
  std::string problem;
  {
    const std::lock_guard lock(mutex_);
    problem = rate_problem(decoded.message->client_id);
    if (problem.empty()) queue_pointer(std::move(*decoded.message), bytes.size());
  }
  if (!problem.empty()) return refuse("pointer", problem);
  changed_.notify_one();
}

void Inbox::receive_command(ByteView bytes) {
  Decoded<command_t> decoded = decode_command(bytes);
  if (!decoded.message) return refuse("command", decoded.problem);
  if (is_for_another(decoded.message->server_id)) return;
  std::string problem;
  {
    const std::lock_guard lock(mutex_);
    problem = rate_problem(decoded.message->client_id);
    if (problem.empty()) problem = queue_command(std::move(*decoded.message), bytes.size());
  }
  if (!problem.empty()) return refuse("command", problem);
  changed_.notify_one();
}

void Inbox::receive_status(ByteView bytes) {
  const Decoded<Heartbeat> decoded = decode_heartbeat(bytes);
  if (!decoded.message) return refuse("status", decoded.problem);
  const Heartbeat& heartbeat = *decoded.message;
  if (heartbeat.server_id == server_id_) return;
  const std::lock_guard lock(mutex_);
  if (heartbeat.leaving) {
    if (heartbeat.server_id == rival_) rival_ = 0;
    return;
  }
  rival_ = heartbeat.server_id;
  rival_heard_ = Clock::now();
}

std::int64_t Inbox::rival() {
  const std::lock_guard lock(mutex_);
  if (rival_ != 0 && Clock::now() - rival_heard_ > kRivalSilence) rival_ = 0;
  return rival_;
}

std::string Inbox::rate_problem(const std::string& client_id) {
  if (rates_.size() >= kMaxKnownClients && !rates_.contains(client_id)) rates_.clear();
  RateLimit& rate = rates_.try_emplace(client_id, kMaxMessageRate, kMaxMessageBurst).first->second;
  if (rate.take(Clock::now())) return {};
  return "client '" + client_id + "' sends more than " + std::to_string(static_cast<int>(kMaxMessageRate)) +
         " messages per second";
}

/// The waiting message that this pointer's may replace: with no command after it.
pointer_t* Inbox::find_replaceable(int pointer) {
  for (auto waiting = events_.rbegin(); waiting != events_.rend(); ++waiting) {
    auto* message = std::get_if<pointer_t>(&waiting->event);
    if (message == nullptr) return nullptr;
    if (message->pointer == pointer) return message;
  }
  return nullptr;
}

void Inbox::queue_pointer(pointer_t pointer, std::size_t bytes) {
  if (pointer_t* waiting = find_replaceable(pointer.pointer)) {
    const bool stale = waiting->client_id == pointer.client_id && waiting->sequence > pointer.sequence;
    if (!stale) *waiting = std::move(pointer);
    return;
  }
  events_.push_back({std::move(pointer), bytes});
  waiting_bytes_ += bytes;
}

std::string Inbox::queue_command(command_t command, std::size_t bytes) {
  if (events_.size() >= kMaxEvents) return "more than " + std::to_string(kMaxEvents) + " commands are waiting";
  if (waiting_bytes_ + bytes > kMaxWaitingBytes) {
    return "the commands that wait have more than " + std::to_string(kMaxWaitingBytes) + " bytes";
  }
  events_.push_back({std::move(command), bytes});
  waiting_bytes_ += bytes;
  return {};
}

std::vector<Inbox::Event> Inbox::take(std::size_t most) {
  const std::lock_guard lock(mutex_);
  std::vector<Event> taken;
  const std::size_t count = std::min(most, events_.size());
  taken.reserve(count);
  while (taken.size() < count) {
    waiting_bytes_ -= events_.front().bytes;
    taken.push_back(std::move(events_.front().event));
    events_.pop_front();
  }
  return taken;
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
