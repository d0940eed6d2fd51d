// The only file beside event_log.cpp that sees LCM itself (the generated types need but its coretypes.h).
#include "lcm_link.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "layfigure/messaging/bus.h"
#include "layfigure/messaging/protocol.h"
#include "layfigure/messaging/send_queue.h"

namespace layfigure::messaging {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kRetryInterval{1};
constexpr std::chrono::seconds kDrainTime{1};
constexpr int kReceiveTimeoutMs = 100;       // how long the destructor may wait for the receive thread
constexpr int kReceiveQueueCapacity = 4096;  // messages between LCM's own thread and ours: commands come in bursts

/// Mutes stderr while LCM connects: it reports failures there itself, in several lines; we do in one.
class MutedStderr {
 public:
  MutedStderr() : saved_(dup(STDERR_FILENO)) {
    const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (null < 0) return;
    dup2(null, STDERR_FILENO);
    close(null);
  }
  ~MutedStderr() {
    if (saved_ < 0) return;
    dup2(saved_, STDERR_FILENO);
    close(saved_);
  }
  MutedStderr(const MutedStderr&) = delete;
  MutedStderr& operator=(const MutedStderr&) = delete;

 private:
  int saved_;
};

bool is_tcpq(const std::string& url) { return url.starts_with("tcpq:"); }

/// LCM's C callback.
void receive(const lcm::ReceiveBuffer* buffer, const std::string&, const Route* route) noexcept {
  route->take(ByteView(static_cast<const std::uint8_t*>(buffer->data), buffer->data_size));
}

/// While one lives, what is written to a TCP socket gathers: LCM writes a message in five pieces, each of which would
/// otherwise be a packet of its own that wakes the other side up.
class Cork {
 public:
  explicit Cork(int socket) : socket_(socket) { set(1); }
  ~Cork() { set(0); }
  Cork(const Cork&) = delete;
  Cork& operator=(const Cork&) = delete;

 private:
  void set(int on) const { setsockopt(socket_, IPPROTO_TCP, TCP_CORK, &on, sizeof on); }

  int socket_;
};

/// No delay for small messages, and no endless wait for a server that has stopped in the middle of one. False for -1,
/// which LCM has if the server is not there: its constructor does not mind.
bool tune_socket(int socket) {
  const int on = 1;
  const timeval stalled{1, 0};
  return setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on) == 0 &&
         setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &stalled, sizeof stalled) == 0 &&
         setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &stalled, sizeof stalled) == 0;
}

/// An LCM instance, null if it cannot be had. LCM's tcpq instance is not thread-safe: each thread has its own.
std::unique_ptr<lcm::LCM> connect(const std::string& url, const Routes& routes) {
  const MutedStderr muted;
  auto link = std::make_unique<lcm::LCM>(url);
  if (!link->good()) return nullptr;
  if (is_tcpq(url) && !tune_socket(link->getFileno())) return nullptr;
  for (const Route& route : routes) {
    lcm::Subscription* subscription = link->subscribeFunction(route.channel, receive, &route);
    if (subscription == nullptr) return nullptr;
    subscription->setQueueCapacity(kReceiveQueueCapacity);
  }
  return link;
}

std::string connection_problem(const std::string& url) {
  if (is_tcpq(url)) return "cannot reach an LCM tcpq server at " + url + ": start it first, or use --broker";
  return "cannot open the LCM bus " + url +
         ": expected udpm://ADDRESS:PORT?ttl=N with a multicast route, or tcpq://HOST:PORT; or use --broker";
}

}  // namespace

struct LcmLink::Impl {
  Impl(std::string link_url, Routes link_routes);
  ~Impl();

  void receive_loop();
  void send_loop();
  void send(const Frame& frame);
  bool publish_whole(const Frame& frame);
  void push(std::string channel, Bytes bytes);
  std::shared_ptr<const Frame> next_frame();
  /// Replaces a lost connection, once a second until it succeeds or the bus is closed.
  void reconnect(std::unique_ptr<lcm::LCM>& link, const Routes& link_routes);
  bool wait_closing(std::chrono::milliseconds time);

  const std::string url;
  const Routes routes;  // the receiving link's; the sending one has none
  std::unique_ptr<lcm::LCM> receiver;
  std::unique_ptr<lcm::LCM> sender;

  mutable std::mutex mutex;
  std::condition_variable changed;
  SendQueue queue;
  std::int64_t lost{0};  // did not fit into the queue
  bool closing{false};
  Clock::time_point drain_deadline{};
  std::thread receive_thread;
  std::thread send_thread;
};

LcmLink::Impl::Impl(std::string link_url, Routes link_routes)
    : url(std::move(link_url)), routes(std::move(link_routes)) {
  receiver = connect(url, routes);
  sender = connect(url, {});
  if (receiver == nullptr || sender == nullptr) throw BusError(connection_problem(url));
  receive_thread = std::thread([this] { receive_loop(); });
  send_thread = std::thread([this] { send_loop(); });
}

LcmLink::Impl::~Impl() {
  {
    const std::lock_guard lock(mutex);
    closing = true;
    drain_deadline = Clock::now() + kDrainTime;
  }
  changed.notify_all();
  receive_thread.join();
  send_thread.join();
}

void LcmLink::Impl::receive_loop() {
  while (!wait_closing({})) {
    if (receiver->handleTimeout(kReceiveTimeoutMs) < 0) reconnect(receiver, routes);
  }
}

void LcmLink::Impl::send_loop() {
  while (const std::shared_ptr<const Frame> frame = next_frame()) send(*frame);
}

void LcmLink::Impl::send(const Frame& frame) {
  if (publish_whole(frame)) return;
  if (!is_tcpq(url)) return;  // a datagram that was not taken is lost, as any datagram may be
  reconnect(sender, {});
}

bool LcmLink::Impl::publish_whole(const Frame& frame) {
  std::optional<Cork> cork;
  if (is_tcpq(url)) cork.emplace(sender->getFileno());
  return sender->publish(frame.channel, frame.bytes.data(), static_cast<unsigned int>(frame.bytes.size())) >= 0;
}

void LcmLink::Impl::reconnect(std::unique_ptr<lcm::LCM>& link, const Routes& link_routes) {
  spdlog::warn("lost the LCM bus {}; connecting again", url);
  while (!wait_closing(kRetryInterval)) {
    std::unique_ptr<lcm::LCM> fresh = connect(url, link_routes);
    if (fresh == nullptr) continue;
    link = std::move(fresh);
    spdlog::info("connected to the LCM bus {} again", url);
    return;
  }
}

bool LcmLink::Impl::wait_closing(std::chrono::milliseconds time) {
  std::unique_lock lock(mutex);
  return changed.wait_until(lock, Clock::now() + time, [this] { return closing; });
}

std::shared_ptr<const Frame> LcmLink::Impl::next_frame() {
  std::unique_lock lock(mutex);
  changed.wait(lock, [this] { return closing || !queue.empty(); });
  if (closing && Clock::now() > drain_deadline) return nullptr;
  return queue.pop();
}

void LcmLink::Impl::push(std::string channel, Bytes bytes) {
  const bool is_state = is_state_channel(channel);
  auto frame = std::make_shared<Frame>(Frame{std::move(channel), std::move(bytes), is_state});
  bool queued = false;
  {
    const std::lock_guard lock(mutex);
    queued = queue.push(frame);
    if (!queued) ++lost;
  }
  if (queued) return changed.notify_all();
  spdlog::error("the LCM bus {} is stuck: a message on {} is lost", url, frame->channel);
}

LcmLink::LcmLink(const std::string& url, Routes routes) : impl_(std::make_unique<Impl>(url, std::move(routes))) {}

LcmLink::~LcmLink() = default;

void LcmLink::publish(std::string channel, Bytes bytes) { impl_->push(std::move(channel), std::move(bytes)); }

std::int64_t LcmLink::dropped_messages() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->queue.dropped() + impl_->lost;
}

}  // namespace layfigure::messaging
