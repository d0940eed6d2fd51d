// The only file beside event_log.cpp that sees LCM itself (the generated types need but its coretypes.h).
#include "layfigure/messaging/bus.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <atomic>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>
#include <mutex>
#include <thread>
#include <utility>

#include "layfigure/messaging/broker.h"
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

/// What a subscription's callback needs; must outlive the connection.
struct Route {
  std::string channel;
  Bus::Handler handler;
};

/// A C callback: nothing may be thrown through it.
void receive(const lcm::ReceiveBuffer* buffer, const std::string& channel, const Route* route) noexcept {
  try {
    route->handler(ByteView(static_cast<const std::uint8_t*>(buffer->data), buffer->data_size));
  } catch (const std::exception& error) {
    spdlog::error("{}: {}", channel, error.what());
  }
}

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
std::unique_ptr<lcm::LCM> connect(const std::string& url, const std::string& broker_key,
                                  const std::vector<Route>& routes) {
  const MutedStderr muted;
  auto link = std::make_unique<lcm::LCM>(url);
  if (!link->good()) return nullptr;
  if (is_tcpq(url) && !tune_socket(link->getFileno())) return nullptr;
  if (!broker_key.empty()) {
    link->publish(kBrokerKeyChannel, broker_key.data(), static_cast<unsigned int>(broker_key.size()));
  }
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

std::string default_bus_url() {
  const char* url = std::getenv("LCM_DEFAULT_URL");
  return url != nullptr && *url != '\0' ? url : "udpm://239.255.76.67:7667?ttl=0";
}

int multicast_ttl(std::string_view url) {
  constexpr std::string_view kOption = "ttl=";
  if (!url.starts_with("udpm:")) return 0;
  int ttl = 0;
  for (std::size_t at = url.find('?'); at != std::string_view::npos; at = url.find('&', at + 1)) {
    const std::string_view option = url.substr(at + 1);
    if (!option.starts_with(kOption)) continue;
    std::from_chars(option.data() + kOption.size(), option.data() + option.size(), ttl);
  }
  return ttl;
}

struct Bus::Impl {
  Impl(const BusSettings& settings, Handlers handlers);
  ~Impl();

  void receive_loop();
  void send_loop();
  void send(const Frame& frame);
  void push(Channel channel, Bytes bytes);
  std::shared_ptr<const Frame> next_frame();
  /// Replaces a lost connection, once a second until it succeeds or the bus is closed.
  void reconnect(std::unique_ptr<lcm::LCM>& link, const std::vector<Route>& link_routes);
  bool wait_closing(std::chrono::milliseconds time);

  const std::string url;
  const std::string prefix;
  const std::string broker_key;
  std::vector<Route> routes;  // the receiving link's; the sending one has none
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

Bus::Impl::Impl(const BusSettings& settings, Handlers handlers)
    : url(settings.url), prefix(settings.channel_prefix), broker_key(settings.broker_key) {
  for (auto& [channel, handler] : handlers) routes.push_back({channel_name(prefix, channel), std::move(handler)});
  receiver = connect(url, broker_key, routes);
  sender = connect(url, broker_key, {});
  if (receiver == nullptr || sender == nullptr) throw BusError(connection_problem(url));
  receive_thread = std::thread([this] { receive_loop(); });
  send_thread = std::thread([this] { send_loop(); });
}

Bus::Impl::~Impl() {
  {
    const std::lock_guard lock(mutex);
    closing = true;
    drain_deadline = Clock::now() + kDrainTime;
  }
  changed.notify_all();
  receive_thread.join();
  send_thread.join();
}

void Bus::Impl::receive_loop() {
  while (!wait_closing({})) {
    if (receiver->handleTimeout(kReceiveTimeoutMs) < 0) reconnect(receiver, routes);
  }
}

void Bus::Impl::send_loop() {
  while (const std::shared_ptr<const Frame> frame = next_frame()) send(*frame);
}

void Bus::Impl::send(const Frame& frame) {
  const auto size = static_cast<unsigned int>(frame.bytes.size());
  if (sender->publish(frame.channel, frame.bytes.data(), size) >= 0) return;
  if (!is_tcpq(url)) return;  // a datagram that was not taken is lost, as any datagram may be
  reconnect(sender, {});
}

void Bus::Impl::reconnect(std::unique_ptr<lcm::LCM>& link, const std::vector<Route>& link_routes) {
  spdlog::warn("lost the LCM bus {}; connecting again", url);
  while (!wait_closing(kRetryInterval)) {
    std::unique_ptr<lcm::LCM> fresh = connect(url, broker_key, link_routes);
    if (fresh == nullptr) continue;
    link = std::move(fresh);
    spdlog::info("connected to the LCM bus {} again", url);
    return;
  }
}

bool Bus::Impl::wait_closing(std::chrono::milliseconds time) {
  std::unique_lock lock(mutex);
  return changed.wait_until(lock, Clock::now() + time, [this] { return closing; });
}

std::shared_ptr<const Frame> Bus::Impl::next_frame() {
  std::unique_lock lock(mutex);
  changed.wait(lock, [this] { return closing || !queue.empty(); });
  if (closing && Clock::now() > drain_deadline) return nullptr;
  return queue.pop();
}

void Bus::Impl::push(Channel channel, Bytes bytes) {
  std::string name = channel_name(prefix, channel);
  const bool is_state = is_state_channel(name);
  auto frame = std::make_shared<Frame>(Frame{std::move(name), std::move(bytes), is_state});
  bool queued = false;
  {
    const std::lock_guard lock(mutex);
    queued = queue.push(frame);
    if (!queued) ++lost;
  }
  if (queued) return changed.notify_all();
  spdlog::error("the LCM bus {} is stuck: a message on {} is lost", url, frame->channel);
}

Bus::Bus(const BusSettings& settings, Handlers handlers)
    : impl_(std::make_unique<Impl>(settings, std::move(handlers))) {}

Bus::~Bus() = default;

void Bus::publish_bytes(Channel channel, Bytes bytes) { impl_->push(channel, std::move(bytes)); }

std::int64_t Bus::dropped_messages() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->queue.dropped() + impl_->lost;
}

}  // namespace layfigure::messaging
