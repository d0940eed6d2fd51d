#include "tcpq_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <thread>

namespace layfigure::messaging {
namespace {

constexpr int kPatienceMs = 10000;  // for a machine under load; never waited for in a test that passes

std::string word(std::uint32_t value) {
  const std::uint32_t big_endian = htonl(value);
  return {reinterpret_cast<const char*>(&big_endian), sizeof big_endian};
}

std::string unique_channel() {
  static int count = 0;
  return "ECHO_" + std::to_string(++count);
}

}  // namespace

LcmClient::LcmClient(const std::string& url) : lcm_(url), echo_channel_(unique_channel()) {
  const int on = 1;
  if (setsockopt(lcm_.getFileno(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on) != 0) {
    throw std::runtime_error("no connection to " + url);
  }
  subscribe(echo_channel_);
}

void LcmClient::publish(const std::string& channel, const std::string& data) {
  lcm_.publish(channel, data.data(), static_cast<unsigned int>(data.size()));
}

lcm::Subscription* LcmClient::subscribe(const std::string& pattern) {
  lcm::Subscription* subscription = lcm_.subscribe(pattern, &LcmClient::receive_one, this);
  synchronize();
  return subscription;
}

void LcmClient::unsubscribe(lcm::Subscription* subscription) {
  lcm_.unsubscribe(subscription);
  synchronize();
}

void LcmClient::synchronize() {
  publish(echo_channel_, "");
  ++echoes_sent_;
  while (echoes_seen_ < echoes_sent_ && handle_one()) {
  }
  if (echoes_seen_ < echoes_sent_) throw std::runtime_error("the broker does not answer");
}

const std::vector<Received>& LcmClient::receive(std::size_t count) {
  while (received_.size() < count && handle_one()) {
  }
  return received_;
}

bool LcmClient::handle_one() { return lcm_.handleTimeout(kPatienceMs) > 0; }

void LcmClient::receive_one(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
  if (channel == echo_channel_) {
    ++echoes_seen_;
  } else {
    received_.push_back({channel, {static_cast<const char*>(buffer->data), buffer->data_size}});
  }
}

RawClient::RawClient(std::uint16_t port, const std::string& address) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  inet_pton(AF_INET, address.c_str(), &to.sin_addr);
  const timeval patience{kPatienceMs / 1000, 0};
  setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  connected_ = connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
}

RawClient::~RawClient() { close(socket_); }

void RawClient::send(const std::string& bytes) { ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }

void RawClient::greet() { send(word(0x287617fb) + word(0x0100)); }

void RawClient::subscribe(const std::string& pattern) {
  send(word(2) + word(static_cast<std::uint32_t>(pattern.size())) + pattern);
}

std::optional<std::size_t> RawClient::read_to_the_end() {
  std::array<char, 65536> buffer;
  std::size_t total = 0;
  ssize_t size = 0;
  while ((size = recv(socket_, buffer.data(), buffer.size(), 0)) > 0) total += static_cast<std::size_t>(size);
  if (size < 0 && errno != ECONNRESET) return std::nullopt;
  return total;
}

DeadPort::DeadPort() : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  bind(socket_, reinterpret_cast<const sockaddr*>(&address), size);
  getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
}

DeadPort::~DeadPort() { close(socket_); }

std::vector<int> no_delay_of_connections(std::uint16_t port) {
  constexpr int kMostDescriptors = 1024;
  std::vector<int> delays;
  for (int descriptor = 0; descriptor < kMostDescriptors; ++descriptor) {
    sockaddr_in here{};
    sockaddr_in there{};
    socklen_t size = sizeof here;
    if (getsockname(descriptor, reinterpret_cast<sockaddr*>(&here), &size) != 0) continue;
    size = sizeof there;
    if (getpeername(descriptor, reinterpret_cast<sockaddr*>(&there), &size) != 0) continue;
    if (ntohs(here.sin_port) != port && ntohs(there.sin_port) != port) continue;
    int on = 0;
    size = sizeof on;
    getsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, &size);
    delays.push_back(on);
  }
  return delays;
}

bool eventually(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(kPatienceMs);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace layfigure::messaging
