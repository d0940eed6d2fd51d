#include "layfigure/messaging/codec.h"

#include <algorithm>
#include <cmath>
#include <layfigure/status_t.hpp>

#include "layfigure/messaging/protocol.h"
#include "wire_scan.h"

namespace layfigure::messaging {
namespace {

// Far above what a command needs, far below what could hurt.
constexpr std::size_t kMaxText = 4096;
constexpr std::size_t kMaxClientId = 64;
constexpr std::size_t kMaxArguments = 64;
constexpr std::size_t kMaxValues = 65536;
constexpr std::size_t kFingerprint = 8;
constexpr double kMaxPosition = 1e6;           // [m]: beyond any scene
constexpr double kMaxLength = 100.0;           // [m]: beyond any device's string
constexpr double kQuaternionTolerance = 1e-3;  // a client may compute in single precision

bool pointer_lengths_fit(ByteView bytes) {
  WireScan scan(bytes);
  scan.skip(kFingerprint + 4 + 8 + 8);  // protocol_version, time_us, server_id
  scan.skip_string(kMaxClientId);
  scan.skip(8 + 4 + 7 * 8);  // sequence, pointer, position, rotation
  return scan.complete();
}

bool spidar_state_lengths_fit(ByteView bytes) {
  WireScan scan(bytes);
  scan.skip(kFingerprint + 4 + 8);  // protocol_version, time_us
  scan.skip_string(kMaxClientId);
  scan.skip(8 + 4 + 8 * 8 + 7 * 8 + 8 + 4);  // sequence, kind, lengths, pose, grip, buttons
  return scan.complete();
}

bool command_lengths_fit(ByteView bytes) {
  WireScan scan(bytes);
  scan.skip(kFingerprint + 4 + 8 + 8);  // protocol_version, time_us, server_id
  scan.skip_string(kMaxClientId);
  scan.skip(8);  // sequence
  scan.skip_string(kMaxText);
  for (std::size_t left = scan.count(kMaxArguments); left > 0; --left) {
    scan.skip_string(kMaxText);
    scan.skip_string(kMaxText);
    scan.skip(8 * scan.count(kMaxValues));
  }
  return scan.complete();
}

template <class Message>
Decoded<Message> refused(std::string problem) {
  return {std::nullopt, std::move(problem)};
}

template <class Message>
std::string form_problem() {
  return "not a layfigure." + std::string(Message::getTypeName()) + " of protocol version " +
         std::to_string(kProtocolVersion);
}

const std::string& sender_of(const pointer_t& pointer) { return pointer.client_id; }
const std::string& sender_of(const command_t& command) { return command.client_id; }
const std::string& sender_of(const spidar_state_t& state) { return state.device_id; }
template <class Message>
constexpr const char* kSenderField = "client_id";
template <>
constexpr const char* kSenderField<spidar_state_t> = "device_id";

template <class Message>
Decoded<Message> decode(ByteView bytes, bool lengths_fit) {
  Message message;
  const int size = static_cast<int>(bytes.size());
  if (!lengths_fit || message.decode(bytes.data(), 0, size) != size) {
    return refused<Message>(form_problem<Message>());
  }
  if (sender_of(message).empty() || !is_plain_text(sender_of(message))) {
    return refused<Message>(std::string(kSenderField<Message>) + " is empty or not plain UTF-8");
  }
  if (message.sequence < 1) {
    return refused<Message>("sequence is " + std::to_string(message.sequence) + ", expected 1 or more");
  }
  return {std::move(message), {}};
}

std::string version_problem(std::int32_t version) {
  if (version == kProtocolVersion) return {};
  return "protocol version " + std::to_string(version) + ", this server speaks " + std::to_string(kProtocolVersion);
}

std::string pose_problem(const double (&position)[3], const double (&rotation)[4]) {
  if (!std::ranges::all_of(position, [](double x) { return std::abs(x) <= kMaxPosition; })) {
    return "position is not finite or beyond 1e6 m";
  }
  double norm_squared = 0.0;
  for (const double component : rotation) norm_squared += component * component;
  if (!(std::abs(std::sqrt(norm_squared) - 1.0) <= kQuaternionTolerance)) {
    return "rotation is not a unit quaternion";
  }
  return {};
}

std::string spidar_state_problem(const spidar_state_t& state) {
  if (std::string problem = version_problem(state.protocol_version); !problem.empty()) return problem;
  if (state.kind < kSpidarLengths || state.kind > kSpidarRejected) {
    return "kind " + std::to_string(state.kind) + ", expected 0 (lengths), 1 (pose) or 2 (rejected)";
  }
  if (!(state.grip >= 0.0 && state.grip <= 1.0)) return "grip is not from 0 to 1";
  if (state.kind == kSpidarPose) return pose_problem(state.position, state.rotation);
  const bool lengths_fit = std::ranges::all_of(state.lengths, [](double x) { return std::abs(x) <= kMaxLength; });
  if (state.kind == kSpidarLengths && !lengths_fit) return "a length is not finite or beyond 100 m";
  return {};
}

std::string pointer_problem(const pointer_t& pointer) {
  if (std::string problem = version_problem(pointer.protocol_version); !problem.empty()) return problem;
  if (pointer.pointer < 0 || pointer.pointer >= kMaxPointers) {
    return "pointer " + std::to_string(pointer.pointer) + ", expected 0 to " + std::to_string(kMaxPointers - 1);
  }
  return pose_problem(pointer.position, pointer.rotation);
}

/// Bytes of the UTF-8 sequence that begins with `lead`, 0 if none does.
std::size_t sequence_length(unsigned char lead) {
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead < 0xE0) return 2;
  if (lead >= 0xE0 && lead < 0xF0) return 3;
  if (lead >= 0xF0 && lead < 0xF5) return 4;
  return 0;
}

/// The ranges of the second byte that rule out overlong forms, surrogates and what is beyond U+10FFFF.
bool is_second_byte(unsigned char lead, unsigned char second) {
  if (lead == 0xE0) return second >= 0xA0 && second <= 0xBF;
  if (lead == 0xED) return second >= 0x80 && second <= 0x9F;
  if (lead == 0xF0) return second >= 0x90 && second <= 0xBF;
  if (lead == 0xF4) return second >= 0x80 && second <= 0x8F;
  return second >= 0x80 && second <= 0xBF;
}

bool is_character(std::string_view sequence) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(sequence[i]); };
  if (sequence.size() == 1) return byte(0) >= 0x20 && byte(0) != 0x7F;
  if (sequence.size() == 2 && byte(0) == 0xC2 && byte(1) < 0xA0) return false;  // the C1 controls
  if (!is_second_byte(byte(0), byte(1))) return false;
  return std::ranges::all_of(sequence.substr(2), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; });
}

}  // namespace

Decoded<Heartbeat> decode_heartbeat(ByteView bytes) {
  constexpr std::size_t kStateAt =
      kFingerprint + 4 + 8 + 8 + 4;  // after version, time_us, server_id, the state's length
  const auto read = [&](std::size_t at, std::size_t size) {
    std::uint64_t value = 0;
    for (const std::uint8_t byte : bytes.subspan(at, size)) value = value << 8U | byte;
    return value;
  };
  if (bytes.size() < kStateAt + kLeaving.size() ||
      read(0, kFingerprint) != static_cast<std::uint64_t>(status_t::getHash())) {
    return refused<Heartbeat>(form_problem<status_t>());
  }
  std::string problem = version_problem(static_cast<std::int32_t>(read(kFingerprint, 4)));
  if (!problem.empty()) return refused<Heartbeat>(std::move(problem));
  const ByteView state = bytes.subspan(kStateAt, kLeaving.size());
  return {Heartbeat{.server_id = static_cast<std::int64_t>(read(kFingerprint + 4 + 8, 8)),
                    .leaving = std::ranges::equal(state, kLeaving)},
          {}};
}

bool is_plain_text(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = sequence_length(static_cast<unsigned char>(text.front()));
    if (length == 0 || length > text.size() || !is_character(text.substr(0, length))) return false;
    text.remove_prefix(length);
  }
  return true;
}

Decoded<pointer_t> decode_pointer(ByteView bytes) {
  Decoded<pointer_t> decoded = decode<pointer_t>(bytes, pointer_lengths_fit(bytes));
  if (!decoded.message) return decoded;
  std::string problem = pointer_problem(*decoded.message);
  return problem.empty() ? decoded : refused<pointer_t>(std::move(problem));
}

Decoded<spidar_state_t> decode_spidar_state(ByteView bytes) {
  Decoded<spidar_state_t> decoded = decode<spidar_state_t>(bytes, spidar_state_lengths_fit(bytes));
  if (!decoded.message) return decoded;
  std::string problem = spidar_state_problem(*decoded.message);
  return problem.empty() ? decoded : refused<spidar_state_t>(std::move(problem));
}

Decoded<command_t> decode_command(ByteView bytes) {
  if (bytes.size() > kMaxCommandBytes) {
    return refused<command_t>(std::to_string(bytes.size()) + " bytes, at most " + std::to_string(kMaxCommandBytes));
  }
  Decoded<command_t> decoded = decode<command_t>(bytes, command_lengths_fit(bytes));
  if (!decoded.message) return decoded;
  bool plain = is_plain_text(decoded.message->name);
  for (const argument_t& argument : decoded.message->arguments) {
    plain = plain && is_plain_text(argument.name) && is_plain_text(argument.text);
  }
  return plain ? decoded : refused<command_t>("a text is not plain UTF-8");
}

}  // namespace layfigure::messaging
