#include "broker_client.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

namespace layfigure::messaging {
namespace {

constexpr std::size_t kReadSize = 64U << 10;  // then the others have their turn
constexpr std::size_t kMaxSubscriptions = 256;
constexpr std::chrono::milliseconds kShortestPause{5};
constexpr std::size_t kMaxRememberedMatches = 1024;

/// libstdc++'s engine without back-references: no pattern can make a match take exponential time.
constexpr auto kRegexFlags = std::regex::ECMAScript | std::regex::optimize | std::regex_constants::__polynomial;

bool would_block(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

}  // namespace

BrokerClient::BrokerClient(int socket, const SendLimits& limits) : socket_(socket), queue_(limits) {
  const int on = 1;
  setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  sending_ = std::make_shared<Frame>(Frame{"", tcpq::greeting(), false});
}

BrokerClient::~BrokerClient() { close(socket_); }

bool BrokerClient::read() {
  std::array<std::uint8_t, kReadSize> piece;
  const ssize_t size = recv(socket_, piece.data(), piece.size(), 0);
  if (size > 0) {
    parser_.feed(ByteView(piece).first(static_cast<std::size_t>(size)));
    return true;
  }
  if (size == 0 || !would_block(errno)) open_ = false;
  return false;
}

std::optional<tcpq::Publish> BrokerClient::next_message(RateLimit::Clock::time_point now) {
  while (is_within_rate(now)) {
    std::optional<tcpq::Request> request = parser_.next();
    if (!request) break;
    (void)rate_.take(now);
    if (auto* message = std::get_if<tcpq::Publish>(&*request)) return std::move(*message);
    if (const auto* added = std::get_if<tcpq::Subscribe>(&*request)) subscribe(added->pattern);
    if (const auto* removed = std::get_if<tcpq::Unsubscribe>(&*request)) unsubscribe(removed->pattern);
  }
  if (!parser_.problem().empty()) refuse(parser_.problem());
  return std::nullopt;
}

/// Every request costs, whatever it is.
bool BrokerClient::is_within_rate(RateLimit::Clock::time_point now) {
  if (paused_until_ > now) return false;
  paused_until_ = kNoPause;
  const RateLimit::Clock::time_point ready = rate_.ready_at(now);
  if (ready <= now) return true;
  // A pause of some length lets it send a batch, instead of waking for each single message.
  paused_until_ = ready + kShortestPause;
  ++pauses_;
  return false;
}

void BrokerClient::subscribe(const std::string& pattern) {
  matches_.clear();
  if (subscriptions_.size() >= kMaxSubscriptions) return refuse("too many subscriptions");
  try {
    subscriptions_.push_back({pattern, std::regex(pattern, kRegexFlags)});
  } catch (const std::regex_error&) {
    refuse("a subscription that is not a regular expression");
  }
}

void BrokerClient::unsubscribe(const std::string& pattern) {
  matches_.clear();
  const auto found = std::ranges::find(subscriptions_, pattern, &Subscription::pattern);
  if (found != subscriptions_.end()) subscriptions_.erase(found);
}

bool BrokerClient::is_subscribed(const std::string& channel) {
  const auto known = matches_.find(channel);
  if (known != matches_.end()) return known->second;
  const bool matching = std::ranges::any_of(subscriptions_, [&](const Subscription& subscription) {
    return std::regex_match(channel, subscription.expression);
  });
  if (matches_.size() >= kMaxRememberedMatches) matches_.clear();
  matches_.emplace(channel, matching);
  return matching;
}

void BrokerClient::deliver(const std::shared_ptr<const Frame>& frame) {
  if (!open_ || !is_subscribed(frame->channel)) return;
  if (!queue_.push(frame)) refuse("it does not read what it subscribed to, and its queue is full");
}

void BrokerClient::flush() {
  while (open_ && send_rest()) {
    sending_ = queue_.pop();
    sent_ = 0;
  }
}

/// True if nothing is left of sending_, and there is more in the queue.
bool BrokerClient::send_rest() {
  while (sending_ != nullptr && sent_ < sending_->bytes.size()) {
    const ByteView rest = ByteView(sending_->bytes).subspan(sent_);
    const ssize_t size = send(socket_, rest.data(), rest.size(), MSG_NOSIGNAL);
    if (size < 0) {
      open_ = open_ && would_block(errno);
      return false;
    }
    sent_ += static_cast<std::size_t>(size);
  }
  sending_ = nullptr;
  return !queue_.empty();
}

void BrokerClient::refuse(std::string problem) {
  open_ = false;
  if (problem_.empty()) problem_ = std::move(problem);
}

}  // namespace layfigure::messaging
