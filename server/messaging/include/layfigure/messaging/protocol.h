#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace layfigure::messaging {

/// First field of every message. A peer that speaks another version is refused.
inline constexpr std::int32_t kProtocolVersion = 1;

/// Pointers are numbered from 0 to kMaxPointers - 1.
inline constexpr std::int32_t kMaxPointers = 16;

/// Bytes of the encoded meshes_t in one mesh_chunk_t.
inline constexpr std::size_t kMeshChunkBytes = 32 * 1024;

/// What one client may send, told in status_t. The rate is of messages per second; so many at once (a burst) are taken
/// after a rest. A command_t has a limit of its own, above what load_pose needs for ten thousand joints.
inline constexpr std::size_t kMaxMessageBytes = 16U << 20;
inline constexpr std::size_t kMaxCommandBytes = 1U << 20;
inline constexpr double kMaxMessageRate = 20'000.0;
inline constexpr double kMaxMessageBurst = 65'536.0;

/// Clients that a broker serves at once.
inline constexpr std::size_t kMaxClients = 256;

/// LCM's limit on the length of a channel's name.
inline constexpr std::size_t kMaxChannelLength = 63;

enum class Channel {
  kCharacter,
  kMesh,
  kPose,
  kPointer,
  kForce,
  kCommand,
  kReply,
  kStatus,
  kSpidarState,
  kSpidarCommand,
  // in logs only
  kLogStart,
  kLogStep,
  kLogSnapshot,
  kLogDevices
};

/// The channel's name on the bus: the prefix, then LAYFIGURE_CHARACTER, LAYFIGURE_MESH, .., SPIDAR_STATE,
/// SPIDAR_COMMAND.
[[nodiscard]] std::string channel_name(std::string_view prefix, Channel channel);

/// True for the channels of which only the newest message matters (POSE, FORCE, STATUS, POINTER and those of the
/// SPIDAR, with any prefix): a slow subscriber loses the oldest of them. Messages of all other channels are never
/// dropped.
[[nodiscard]] bool is_state_channel(std::string_view name);

/// True if `prefix` is made of letters, digits and underscores only (it becomes part of a regular expression) and is
/// short enough for LCM.
[[nodiscard]] bool is_channel_prefix(std::string_view prefix);

}  // namespace layfigure::messaging
