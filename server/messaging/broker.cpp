#include "layfigure/messaging/broker.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "broker_client.h"
#include "layfigure/messaging/protocol.h"

namespace layfigure::messaging {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kDrainTime{500};
constexpr int kDrainPollMs = 10;
constexpr int kForever = -1;
constexpr int kNoSocket = -1;
// Places of what is polled.
constexpr std::size_t kListener = 0;
constexpr std::size_t kWakeUp = 1;
constexpr std::size_t kFirstClient = 2;
constexpr std::chrono::seconds kLogInterval{1};

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

BrokerError listen_error(std::uint16_t port, int error) {
  const std::string where = "cannot listen on 127.0.0.1:" + std::to_string(port) + ": ";
  if (error == EADDRINUSE) return BrokerError(where + "the port is in use; take another, or --broker 0 for a free one");
  return BrokerError(where + std::strerror(error));
}

int listen_on_loopback(std::uint16_t port) {
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (listener < 0) throw listen_error(port, errno);
  const int on = 1;
  setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const sockaddr_in address = loopback(port);
  if (bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(listener, SOMAXCONN) != 0) {
    const int error = errno;
    close(listener);
    throw listen_error(port, error);
  }
  return listener;
}

std::uint16_t bound_port(int listener) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

std::shared_ptr<const Frame> make_frame(const tcpq::Publish& message) {
  return std::make_shared<Frame>(Frame{message.channel, tcpq::frame(message), is_state_channel(message.channel)});
}

}  // namespace

struct Broker::Impl {
  Impl(std::uint16_t wanted_port, const SendLimits& send_limits);
  ~Impl();

  void run();
  void drain();
  /// Waits for something to do, at most `timeout_ms` (-1: for ever), or until a pause of a client is over.
  void poll_once(int timeout_ms);
  [[nodiscard]] int next_pause_end_ms(int timeout_ms, Clock::time_point now) const;
  /// Does what poll_once() has found to be done; true if anything was to be relayed.
  bool serve();
  void post(const std::shared_ptr<const Frame>& frame);
  bool relay_posted();
  void accept_clients();
  bool read_clients();
  void relay(const std::shared_ptr<const Frame>& frame);
  void relay_to_routes(const Frame& frame);
  void flush_clients();
  void drop_closed_clients();
  void report(const std::string& problem);
  [[nodiscard]] bool has_output() const;

  const SendLimits limits;
  const int listener;
  const std::uint16_t port;
  const int wake_up;
  std::atomic<bool> stopping{false};
  std::atomic<std::int64_t> dropped_messages{0};
  std::atomic<std::int64_t> refused_clients{0};
  std::atomic<std::int64_t> pauses{0};
  std::atomic<int> client_count{0};

  std::mutex posted_mutex;
  SendQueue posted;                       // by this process, not yet relayed
  std::atomic<std::int64_t> unposted{0};  // for which it had no room
  std::mutex attached_mutex;              // held while handlers are at work
  std::vector<const Routes*> attached;

  // of the broker's thread alone
  std::vector<std::unique_ptr<BrokerClient>> clients;
  std::vector<pollfd> polled;  // the listener, the wake-up, then the clients in their order
  std::int64_t dropped_by_former_clients{0};
  std::int64_t pauses_of_former_clients{0};
  Clock::time_point next_log{};
  std::thread thread;
};

Broker::Impl::Impl(std::uint16_t wanted_port, const SendLimits& send_limits)
    : limits(send_limits),
      listener(listen_on_loopback(wanted_port)),
      port(bound_port(listener)),
      wake_up(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      posted(send_limits),
      thread([this] { run(); }) {}

Broker::Impl::~Impl() {
  stopping = true;
  eventfd_write(wake_up, 1);
  thread.join();
  close(wake_up);
  close(listener);
}

void Broker::Impl::run() {
  while (!stopping) {
    poll_once(kForever);
    serve();
  }
  drain();
}

void Broker::Impl::drain() {
  const Clock::time_point deadline = Clock::now() + kDrainTime;
  do {
    poll_once(0);
  } while (serve() && Clock::now() < deadline);
  while (has_output() && Clock::now() < deadline) {
    poll_once(kDrainPollMs);
    flush_clients();
  }
}

bool Broker::Impl::serve() {
  if (polled[kListener].revents != 0) accept_clients();
  const bool posted_any = relay_posted();
  const bool read_any = read_clients();
  flush_clients();
  drop_closed_clients();
  return posted_any || read_any;
}

void Broker::Impl::poll_once(int timeout_ms) {
  const Clock::time_point now = Clock::now();
  polled.assign({{listener, POLLIN, 0}, {wake_up, POLLIN, 0}});
  for (const auto& client : clients) {
    const int events = (client->paused_until() > now ? 0 : POLLIN) | (client->has_output() ? POLLOUT : 0);
    // Who is paused and has left would be reported again and again.
    polled.push_back({events != 0 ? client->socket() : kNoSocket, static_cast<short>(events), 0});
  }
  poll(polled.data(), polled.size(), next_pause_end_ms(timeout_ms, now));
}

int Broker::Impl::next_pause_end_ms(int timeout_ms, Clock::time_point now) const {
  for (const auto& client : clients) {
    if (client->paused_until() == BrokerClient::kNoPause) continue;
    // What was read before a pause waits for its end, also for one that has come since.
    const auto rest = std::chrono::ceil<std::chrono::milliseconds>(client->paused_until() - now);
    const int rest_ms = std::max(0, static_cast<int>(rest.count()));
    timeout_ms = timeout_ms < 0 ? rest_ms : std::min(timeout_ms, rest_ms);
  }
  return timeout_ms;
}

void Broker::Impl::accept_clients() {
  int socket = -1;
  while ((socket = accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)) >= 0) {
    if (clients.size() < kMaxClients) {
      clients.push_back(std::make_unique<BrokerClient>(socket, limits));
    } else {
      close(socket);
      ++refused_clients;
      report("there are " + std::to_string(kMaxClients) + " already");
    }
  }
}

void Broker::Impl::post(const std::shared_ptr<const Frame>& frame) {
  bool was_empty = false;
  bool fits = false;
  {
    const std::lock_guard lock(posted_mutex);
    was_empty = posted.empty();
    const std::int64_t dropped_before = posted.dropped();
    fits = posted.push(frame);
    unposted += posted.dropped() - dropped_before + (fits ? 0 : 1);
  }
  if (!fits) return spdlog::error("the broker is stuck: a message on {} is lost", frame->channel);
  if (was_empty) eventfd_write(wake_up, 1);  // else the broker has been woken up already
}

bool Broker::Impl::relay_posted() {
  eventfd_t count = 0;
  if (polled[kWakeUp].revents != 0) eventfd_read(wake_up, &count);
  SendQueue taken(limits);
  {
    const std::lock_guard lock(posted_mutex);
    std::swap(taken, posted);
  }
  const bool any = !taken.empty();
  while (const std::shared_ptr<const Frame> frame = taken.pop()) relay(frame);
  return any;
}

/// Those that poll_once() found readable. Others may have requests that were read before a pause.
bool Broker::Impl::read_clients() {
  bool any = false;
  const Clock::time_point now = Clock::now();
  for (std::size_t k = 0; k < clients.size(); ++k) {
    BrokerClient& client = *clients[k];
    const bool readable = kFirstClient + k < polled.size() && (polled[kFirstClient + k].revents & ~POLLOUT) != 0;
    any = (readable && client.is_open() && client.paused_until() <= now && client.read()) || any;
    while (const std::optional<tcpq::Publish> message = client.next_message(now)) relay(make_frame(*message));
  }
  return any;
}

void Broker::Impl::relay(const std::shared_ptr<const Frame>& frame) {
  relay_to_routes(*frame);
  for (const auto& client : clients) client->deliver(frame);
}

void Broker::Impl::relay_to_routes(const Frame& frame) {
  const std::lock_guard lock(attached_mutex);
  for (const Routes* routes : attached) {
    for (const Route& route : *routes) {
      if (route.channel == frame.channel) route.take(tcpq::data_of(frame));
    }
  }
}

void Broker::Impl::flush_clients() {
  for (const auto& client : clients) client->flush();
}

void Broker::Impl::drop_closed_clients() {
  std::int64_t dropped = dropped_by_former_clients;
  std::int64_t paused = pauses_of_former_clients;
  for (const auto& client : clients) {
    dropped += client->dropped_messages();
    paused += client->pauses();
    if (client->is_open()) continue;
    dropped_by_former_clients += client->dropped_messages();
    pauses_of_former_clients += client->pauses();
    if (client->problem().empty()) continue;
    ++refused_clients;
    report(client->problem());
  }
  dropped_messages = dropped;
  pauses = paused;
  std::erase_if(clients, [](const auto& client) { return !client->is_open(); });
  client_count = static_cast<int>(clients.size());
}

void Broker::Impl::report(const std::string& problem) {
  if (Clock::now() < next_log) return;
  next_log = Clock::now() + kLogInterval;
  spdlog::warn("disconnected a client of the broker: {} ({} refused so far)", problem, refused_clients.load());
}

bool Broker::Impl::has_output() const {
  return std::ranges::any_of(clients, [](const auto& client) { return client->is_open() && client->has_output(); });
}

Broker::Broker(std::uint16_t port, const SendLimits& limits) : impl_(std::make_unique<Impl>(port, limits)) {}

Broker::~Broker() = default;

std::uint16_t Broker::port() const { return impl_->port; }

std::string Broker::url() const { return "tcpq://127.0.0.1:" + std::to_string(impl_->port); }

void Broker::publish(std::string channel, Bytes bytes) {
  impl_->post(make_frame({std::move(channel), std::move(bytes)}));
}

void Broker::attach(const Routes& routes) {
  const std::lock_guard lock(impl_->attached_mutex);
  impl_->attached.push_back(&routes);
}

void Broker::detach(const Routes& routes) {
  const std::lock_guard lock(impl_->attached_mutex);
  std::erase(impl_->attached, &routes);
}

int Broker::clients() const { return impl_->client_count; }

std::int64_t Broker::pauses() const { return impl_->pauses; }

std::int64_t Broker::dropped_messages() const { return impl_->dropped_messages + impl_->unposted; }

std::int64_t Broker::refused_clients() const { return impl_->refused_clients; }

}  // namespace layfigure::messaging
