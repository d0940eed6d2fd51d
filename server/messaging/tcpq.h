#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "layfigure/messaging/codec.h"
#include "layfigure/messaging/send_queue.h"

namespace layfigure::messaging::tcpq {

/// LCM's tcpq protocol. Both sides begin with a magic word and a version; then a client sends
///     publish:      1, length of channel, channel, length of data, data
///     subscribe:    2, length of pattern, pattern
///     unsubscribe:  3, length of pattern, pattern
/// and the server sends publish messages only. All words are 32 bits, big endian.
inline constexpr std::uint32_t kServerMagic = 0x287617fa;
inline constexpr std::uint32_t kClientMagic = 0x287617fb;
inline constexpr std::uint32_t kVersion = 0x0100;

struct Publish {
  std::string channel;
  Bytes data;
};
struct Subscribe {
  std::string pattern;
};
struct Unsubscribe {
  std::string pattern;
};
using Request = std::variant<Publish, Subscribe, Unsubscribe>;

/// What a server sends first.
[[nodiscard]] Bytes greeting();
/// A message as a server sends it.
[[nodiscard]] Bytes frame(const Publish& message);
/// The data of a message in that form.
[[nodiscard]] ByteView data_of(const Frame& message);

/// Cuts a client's byte stream into requests, whatever the pieces that it arrives in.
class Parser {
 public:
  void feed(ByteView bytes);
  /// The next whole request; none: more bytes are needed, or the client broke the protocol.
  [[nodiscard]] std::optional<Request> next();
  /// What the client did wrong, "" if nothing. No requests come after it.
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  [[nodiscard]] bool has_greeting();
  [[nodiscard]] std::optional<Request> parse_publish();
  /// The length word at `at`, none until it is there; a length above `max` is a problem.
  [[nodiscard]] std::optional<std::size_t> length(std::size_t at, std::size_t max, std::string_view what);
  [[nodiscard]] std::optional<std::string> text(std::size_t at, std::size_t max, std::string_view what);
  [[nodiscard]] bool available(std::size_t size) const { return buffer_.size() - begin_ >= size; }
  [[nodiscard]] std::uint32_t word(std::size_t at) const;
  void consume(std::size_t size);

  Bytes buffer_;
  std::size_t begin_{0};  ///< what is before it is consumed; it is dropped when more is fed
  bool greeted_{false};
  std::string problem_;
};

}  // namespace layfigure::messaging::tcpq
