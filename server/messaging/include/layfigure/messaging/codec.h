#pragma once

#include <cstdint>
#include <layfigure/command_t.hpp>
#include <layfigure/pointer_t.hpp>
#include <layfigure/spidar_state_t.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace layfigure::messaging {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

/// The bytes of a message as LCM carries them: fingerprint, then the fields, big endian. They replace what `bytes`
/// held; allocates only for more than that ever had room for.
template <class Message>
void encode(const Message& message, Bytes& bytes) {
  bytes.resize(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
}

template <class Message>
[[nodiscard]] Bytes encode(const Message& message) {
  Bytes bytes;
  encode(message, bytes);
  return bytes;
}

/// A message from the wire, or what is wrong with it (one line).
template <class Message>
struct Decoded {
  std::optional<Message> message;
  std::string problem;
};

/// What the numbers of a spidar_state_t are.
inline constexpr std::int32_t kSpidarLengths = 0;
inline constexpr std::int32_t kSpidarPose = 1;
inline constexpr std::int32_t kSpidarRejected = 2;

/// Decodes what a client or a device may send. Never throws and never allocates more than the bytes at hand justify,
/// whatever they are: lengths are checked before anything is reserved. Texts must be UTF-8 without control characters.
///
/// A pointer is refused unless its version is ours, its number is in [0, kMaxPointers), its position finite and within
/// 1e6 m, its rotation a unit quaternion (to 1e-3). A command is refused only for its form: its version and arguments
/// are judged, and answered, by who carries it out; or for more than kMaxCommandBytes. A device's state is refused
/// unless its version and its kind are ours and what holds by its kind is finite, lengths within 100 m, the rotation a
/// unit quaternion, the grip 0 to 1.
[[nodiscard]] Decoded<pointer_t> decode_pointer(ByteView bytes);
[[nodiscard]] Decoded<command_t> decode_command(ByteView bytes);
[[nodiscard]] Decoded<spidar_state_t> decode_spidar_state(ByteView bytes);

/// What a status_t says of who speaks.
struct Heartbeat {
  std::int64_t server_id{0};
  bool leaving{false};  ///< it is its last message
};

/// Reads the beginning of a status_t only. Refused unless it is one of this version.
[[nodiscard]] Decoded<Heartbeat> decode_heartbeat(ByteView bytes);

/// The state of a server's last status_t.
inline constexpr std::string_view kLeaving = "leaving";

/// True if `text` is valid UTF-8 without control characters.
[[nodiscard]] bool is_plain_text(std::string_view text);

}  // namespace layfigure::messaging
