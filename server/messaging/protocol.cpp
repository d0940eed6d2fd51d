#include "layfigure/messaging/protocol.h"

#include <algorithm>
#include <array>

namespace layfigure::messaging {
namespace {

constexpr std::array<std::string_view, 14> kNames{
    "LAYFIGURE_CHARACTER", "LAYFIGURE_MESH",     "LAYFIGURE_POSE",         "LAYFIGURE_POINTER",    "LAYFIGURE_FORCE",
    "LAYFIGURE_COMMAND",   "LAYFIGURE_REPLY",    "LAYFIGURE_STATUS",       "SPIDAR_STATE",         "SPIDAR_COMMAND",
    "LAYFIGURE_LOG_START", "LAYFIGURE_LOG_STEP", "LAYFIGURE_LOG_SNAPSHOT", "LAYFIGURE_LOG_DEVICES"};
constexpr std::array kStateChannels{Channel::kPose,   Channel::kPointer,     Channel::kForce,
                                    Channel::kStatus, Channel::kSpidarState, Channel::kSpidarCommand};
constexpr std::size_t kMaxPrefixLength = 40;  // leaves room for the longest name above

std::string_view bare_name(Channel channel) { return kNames.at(static_cast<std::size_t>(channel)); }

bool is_word_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

}  // namespace

std::string channel_name(std::string_view prefix, Channel channel) {
  return std::string(prefix).append(bare_name(channel));
}

bool is_state_channel(std::string_view name) {
  return std::ranges::any_of(kStateChannels, [&](Channel channel) { return name.ends_with(bare_name(channel)); });
}

bool is_channel_prefix(std::string_view prefix) {
  return prefix.size() <= kMaxPrefixLength && std::ranges::all_of(prefix, is_word_character);
}

}  // namespace layfigure::messaging
