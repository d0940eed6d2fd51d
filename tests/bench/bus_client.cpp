#include "bus_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <layfigure/force_t.hpp>
#include <layfigure/pose_t.hpp>
#include <stdexcept>
#include <thread>
#include <utility>

#include "layfigure/messaging/protocol.h"

namespace layfigure::bench {
namespace {

using messaging::Channel;

constexpr std::chrono::seconds kPatience{10};
constexpr std::chrono::seconds kEffectPatience{1};

template <class Message>
std::optional<Message> decode(messaging::ByteView bytes) {
  Message message;
  const int size = static_cast<int>(bytes.size());
  if (message.decode(bytes.data(), 0, size) != size) return std::nullopt;
  return message;
}

/// Only the head of a pose_t is read: decoding all of it would count as latency. Fingerprint, protocol_version,
/// time_us, server_id, content_hash, sequence.
std::int64_t big_endian(messaging::ByteView bytes, std::size_t at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < 8; ++i) value = (value << 8) | bytes[at + i];
  return static_cast<std::int64_t>(value);
}
constexpr std::size_t kTimeAt = 8 + 4;
constexpr std::size_t kSequenceAt = kTimeAt + 3 * 8;

}  // namespace

BusClient::BusClient(const std::string& url, std::chrono::milliseconds busy)
    : busy_(busy), id_("bench-" + std::to_string(getpid())) {
  bus_ = std::make_unique<messaging::Bus>(messaging::BusSettings{.url = url, .channel_prefix = ""},
                                          messaging::Bus::Handlers{{Channel::kPose,
                                                                    [this](messaging::ByteView bytes) {
                                                                      receive_pose(bytes);
                                                                    }},
                                                                   {Channel::kForce,
                                                                    [this](messaging::ByteView bytes) {
                                                                      receive_force(bytes);
                                                                    }},
                                                                   {Channel::kCharacter,
                                                                    [this](messaging::ByteView bytes) {
                                                                      const std::lock_guard lock(mutex_);
                                                                      character_ = decode<character_t>(bytes);
                                                                      changed_.notify_all();
                                                                    }},
                                                                   {Channel::kReply, [this](messaging::ByteView bytes) {
                                                                      const std::lock_guard lock(mutex_);
                                                                      reply_ = decode<reply_t>(bytes);
                                                                      changed_.notify_all();
                                                                    }}});
}

void BusClient::receive_pose(messaging::ByteView bytes) {
  const Clock::time_point now = Clock::now();
  if (busy_.count() > 0) std::this_thread::sleep_for(busy_);
  if (bytes.size() < kSequenceAt + 8) return;
  const std::lock_guard lock(mutex_);
  arrivals_.push_back({big_endian(bytes, kSequenceAt), big_endian(bytes, kTimeAt), now});
}

void BusClient::receive_force(messaging::ByteView bytes) {
  const std::optional<force_t> force = decode<force_t>(bytes);
  if (!force || force->pointer != 0) return;
  const std::lock_guard lock(mutex_);
  std::array<double, 3> target;
  std::ranges::copy(force->target, target.begin());
  const bool moved = std::exchange(target_, target) != target;
  if (!moved || !awaits_effect_) return;
  const auto pose = std::ranges::find(arrivals_.rbegin(), arrivals_.rend(), force->sequence, &PoseArrival::sequence);
  if (pose == arrivals_.rend()) return;
  effect_ = pose->at;
  awaits_effect_ = false;
  changed_.notify_all();
}

reply_t BusClient::command(const std::string& name, const std::string& bone) {
  command_t command{};
  command.protocol_version = messaging::kProtocolVersion;
  command.client_id = id_;
  command.sequence = ++command_sequence_;
  command.name = name;
  if (!bone.empty()) {
    argument_t argument{};
    argument.name = "bone";
    argument.text = bone;
    command.arguments = {argument};
    command.argument_count = 1;
  }
  std::unique_lock lock(mutex_);
  const Clock::time_point end = Clock::now() + kPatience;
  const auto answered = [&] { return reply_ && reply_->client_id == id_ && reply_->sequence == command.sequence; };
  while (!answered() && Clock::now() < end) {
    bus_->publish(Channel::kCommand, command);
    changed_.wait_for(lock, std::chrono::milliseconds(500), answered);
  }
  if (!answered()) throw std::runtime_error("the server does not answer '" + name + "'");
  if (reply_->accepted == 0) throw std::runtime_error("'" + name + "' was refused: " + reply_->reason);
  return *reply_;
}

std::array<double, 3> BusClient::grab() {
  command("get_character", "");
  std::string bone;
  {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, kPatience, [&] { return character_.has_value(); })) {
      throw std::runtime_error("the server sends no character");
    }
    for (const joint_t& joint : character_->joints) {
      if (joint.is_body != 0) bone = joint.name;
    }
  }
  const reply_t reply = command("grab", bone);
  const auto position = std::ranges::find(reply.results, std::string("position"), &argument_t::name);
  if (position == reply.results.end() || position->values.size() != 3)
    throw std::runtime_error("no position of the grab");
  return {position->values[0], position->values[1], position->values[2]};
}

Clock::time_point BusClient::point(const std::array<double, 3>& position) {
  pointer_t pointer{};
  pointer.protocol_version = messaging::kProtocolVersion;
  pointer.client_id = id_;
  pointer.sequence = ++pointer_sequence_;
  std::ranges::copy(position, pointer.position);
  pointer.rotation[0] = 1.0;
  {
    const std::lock_guard lock(mutex_);
    awaits_effect_ = true;
    effect_.reset();
  }
  const Clock::time_point sent = Clock::now();
  bus_->publish(Channel::kPointer, pointer);
  return sent;
}

std::optional<Clock::time_point> BusClient::wait_for_effect() {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, kEffectPatience, [&] { return effect_.has_value(); });
  return effect_;
}

std::vector<PoseArrival> BusClient::arrivals() {
  const std::lock_guard lock(mutex_);
  return arrivals_;
}

StoppedSubscriber::StoppedSubscriber(const std::string& url) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(url.substr(url.rfind(':') + 1))));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    close(socket_);
    throw std::runtime_error(url + ": cannot be reached");
  }
  // LCM's tcpq: a client's magic word and version, then a subscription to all channels.
  constexpr std::string_view kHello("\x28\x76\x17\xfb\0\0\1\0\0\0\0\2\0\0\0\2.*", 18);
  send(socket_, kHello.data(), kHello.size(), MSG_NOSIGNAL);
}

StoppedSubscriber::~StoppedSubscriber() { close(socket_); }

}  // namespace layfigure::bench
