#include "tcpq.h"

#include "layfigure/messaging/protocol.h"

namespace layfigure::messaging::tcpq {
namespace {

constexpr std::uint32_t kPublish = 1;
constexpr std::uint32_t kSubscribe = 2;
constexpr std::uint32_t kUnsubscribe = 3;
constexpr std::size_t kMaxPattern = 256;
constexpr std::size_t kWord = 4;

void append_word(Bytes& bytes, std::size_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

}  // namespace

Bytes greeting() {
  Bytes bytes;
  append_word(bytes, kServerMagic);
  append_word(bytes, kVersion);
  return bytes;
}

Bytes frame(const Publish& message) {
  Bytes bytes;
  bytes.reserve(3 * kWord + message.channel.size() + message.data.size());
  append_word(bytes, kPublish);
  append_word(bytes, message.channel.size());
  bytes.insert(bytes.end(), message.channel.begin(), message.channel.end());
  append_word(bytes, message.data.size());
  bytes.insert(bytes.end(), message.data.begin(), message.data.end());
  return bytes;
}

ByteView data_of(const Frame& message) { return ByteView(message.bytes).subspan(3 * kWord + message.channel.size()); }

void Parser::feed(ByteView bytes) {
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
  begin_ = 0;
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

std::optional<Request> Parser::next() {
  if (!problem_.empty() || !has_greeting() || !available(kWord)) return std::nullopt;
  const std::uint32_t type = word(0);
  if (type == kPublish) return parse_publish();
  if (type != kSubscribe && type != kUnsubscribe) {
    problem_ = "unknown request " + std::to_string(type);
    return std::nullopt;
  }
  std::optional<std::string> pattern = text(kWord, kMaxPattern, "a subscription");
  if (!pattern) return std::nullopt;
  consume(2 * kWord + pattern->size());
  if (type == kSubscribe) return Subscribe{std::move(*pattern)};
  return Unsubscribe{std::move(*pattern)};
}

bool Parser::has_greeting() {
  if (greeted_) return true;
  if (!available(2 * kWord)) return false;
  if (word(0) != kClientMagic || word(kWord) != kVersion) {
    problem_ = "not a client of LCM's tcpq protocol, version 1.0";
    return false;
  }
  consume(2 * kWord);
  greeted_ = true;
  return true;
}

std::optional<Request> Parser::parse_publish() {
  std::optional<std::string> channel = text(kWord, kMaxChannelLength, "a channel's name");
  if (!channel) return std::nullopt;
  const std::size_t header = 3 * kWord + channel->size();
  const std::optional<std::size_t> size = length(header - kWord, kMaxMessageBytes, "a message");
  if (!size || !available(header + *size)) return std::nullopt;
  const auto data = buffer_.begin() + static_cast<std::ptrdiff_t>(begin_ + header);
  Publish message{std::move(*channel), Bytes(data, data + static_cast<std::ptrdiff_t>(*size))};
  consume(header + *size);
  return message;
}

std::optional<std::size_t> Parser::length(std::size_t at, std::size_t max, std::string_view what) {
  if (!available(at + kWord)) return std::nullopt;
  const std::size_t value = word(at);
  if (value <= max) return value;
  problem_ = std::string(what) + " of " + std::to_string(value) + " bytes, at most " + std::to_string(max);
  return std::nullopt;
}

std::optional<std::string> Parser::text(std::size_t at, std::size_t max, std::string_view what) {
  const std::optional<std::size_t> size = length(at, max, what);
  if (!size || !available(at + kWord + *size)) return std::nullopt;
  const auto begin = buffer_.begin() + static_cast<std::ptrdiff_t>(begin_ + at + kWord);
  return std::string(begin, begin + static_cast<std::ptrdiff_t>(*size));
}

std::uint32_t Parser::word(std::size_t at) const {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < kWord; ++i) value = (value << 8) | buffer_[begin_ + at + i];
  return value;
}

void Parser::consume(std::size_t size) { begin_ += size; }

}  // namespace layfigure::messaging::tcpq
