#include "random_messages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "mutate.h"
#include "sample_messages.h"

namespace layfigure::fuzz {
namespace {

constexpr std::array kCommands{
    "grab", "grab",  "touch",  "touch", "release", "pin",      "unpin",  "set",           "set",        "set",
    "key",  "reset", "step",   "step",  "step",    "step",     "step",   "get_character", "get_mesh",   "no_such",
    "",     "lock",  "unlock", "undo",  "redo",    "snapshot", "mirror", "load_pose",     "get_joints", "history"};
constexpr std::array kArguments{"pointer",
                                "bone",
                                "point",
                                "stiffness",
                                "damping",
                                "mode",
                                "reach",
                                "origin",
                                "direction",
                                "radius",
                                "friction",
                                "magnet",
                                "hold",
                                "pin",
                                "scale",
                                "power_scale",
                                "clutch",
                                "base",
                                "softness",
                                "count",
                                "pointer_sequence",
                                "chunks",
                                "no_such",
                                "axes",
                                "branch",
                                "side",
                                "name",
                                "action",
                                "joints",
                                "all",
                                "yield_torque",
                                "duration",
                                "gravity",
                                "rotations",
                                "yield_torque.factor",
                                "stiffness.bend_y",
                                "hardening",
                                "limits.twist",
                                "limits.swing_y",
                                "max_torque",
                                "place",
                                "angular_stiffness"};
/// Arguments that are words, not numbers.
constexpr std::array<std::string_view, 7> kWords{"bone", "mode", "hold", "axes", "side", "name", "action"};
constexpr std::array kTexts{"hips", "spine",    "arm",  "tip",     "3dof", "6dof", "stiff", "rigid",  "",   "tail", "*",
                            "*p*",  "\xff\xfe", "a\nb", "restore", "list", "left", "twist", "cancel", "go", "put"};
constexpr std::array kNumbers{0.0, 1.0,   2.0,    3.0,   0.008, 0.5, -1.0, 1e-300, 1e6,
                              1e9, 1e300, -1e300, 1e-12, 17.0,  0.1, 1e19, 65536.0};
constexpr std::size_t kLongestNoise = 600;
constexpr std::size_t kMostSteps = 4;  // more, each a step of the doll, would be all that the time is spent on
constexpr int kClients = 100;

std::string to_string(const messaging::Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

template <class Message>
std::string encoded(const Message& message) {
  return to_string(messaging::encode(message));
}

}  // namespace

RandomMessages::RandomMessages(std::uint64_t seed)
    : random_(seed), samples_{encoded(testing::sample_character()),    encoded(testing::sample_command()),
                              encoded(testing::sample_force()),        encoded(testing::sample_mesh_chunk()),
                              encoded(testing::sample_meshes()),       encoded(testing::sample_pointer()),
                              encoded(testing::sample_pose()),         encoded(testing::sample_reply()),
                              encoded(testing::sample_spidar_state()), encoded(testing::sample_spidar_command()),
                              encoded(testing::sample_status())} {}

double RandomMessages::number() {
  switch (below(8)) {
    case 0:
      return std::numeric_limits<double>::quiet_NaN();
    case 1:
      return (once_in(2) ? 1.0 : -1.0) * std::numeric_limits<double>::infinity();
    case 2:
    case 3:
      return kNumbers[below(kNumbers.size())];
    default:
      return std::uniform_real_distribution<double>(-1.0, 1.0)(random_);
  }
}

std::string RandomMessages::text() { return kTexts[below(kTexts.size())]; }

std::string RandomMessages::client_id() { return "client-" + std::to_string(below(kClients)); }

argument_t RandomMessages::argument(const std::string& name) {
  argument_t argument{};
  argument.name = name;
  if (name == "count" && !once_in(8)) {
    argument.values = {static_cast<double>(below(kMostSteps + 1))};
  } else if ((std::ranges::find(kWords, name) != kWords.end()) != once_in(10)) {
    argument.text = text();
  } else {
    constexpr std::array<std::size_t, 8> kCounts{1, 1, 1, 1, 3, 3, 7, 2};
    const std::size_t count = once_in(50) ? below(200) : kCounts[below(kCounts.size())];
    // All of one kind: three good numbers are rare otherwise.
    const bool tame = !once_in(3);
    for (std::size_t i = 0; i < count; ++i) {
      argument.values.push_back(tame ? std::uniform_real_distribution<double>(-0.5, 1.0)(random_) : number());
    }
    if (count == 1 && once_in(2)) argument.values = {static_cast<double>(below(3))};
    if (count == 7 && tame) argument.values = {0.1, 0.2, 0.3, 0.5, 0.5, -0.5, 0.5};
  }
  // A step of more than a few would be a legal way to spend hours.
  if (name == "count") {
    for (double& value : argument.values) value = value > kMostSteps && value <= 1e4 ? 1e5 : value;
  }
  argument.value_count = static_cast<std::int32_t>(argument.values.size());
  return argument;
}

command_t RandomMessages::command() {
  command_t command = testing::make_command(++sequence_, kCommands[below(kCommands.size())]);
  command.client_id = client_id();
  if (once_in(50)) command.sequence = static_cast<std::int64_t>(random_());
  if (once_in(50)) command.protocol_version = static_cast<std::int32_t>(random_());
  // grab, pin and lock need a bone to come to anything.
  if ((command.name == "grab" || command.name == "pin" || command.name == "lock") && !once_in(4)) {
    testing::add_argument(command, testing::text_argument("bone", text()));
  }
  for (std::size_t left = below(4); left > 0; --left) {
    testing::add_argument(command, argument(kArguments[below(kArguments.size())]));
  }
  return command;
}

pointer_t RandomMessages::pointer() {
  pointer_t pointer = testing::sample_pointer();
  pointer.client_id = client_id();
  pointer.sequence = ++sequence_;
  pointer.pointer = static_cast<std::int32_t>(below(18)) - 1;
  for (double& x : pointer.position)
    x = once_in(20) ? number() : std::uniform_real_distribution<double>(-0.5, 0.5)(random_);
  if (once_in(20)) pointer.rotation[below(4)] = number();
  if (once_in(50)) pointer.protocol_version = static_cast<std::int32_t>(random_());
  return pointer;
}

std::string RandomMessages::bytes() {
  const std::size_t kind = below(10);
  if (kind < 4) return encoded(command());
  if (kind < 5) return encoded(pointer());
  if (kind < 6) {
    std::string noise(below(kLongestNoise), '\0');
    for (char& byte : noise) byte = static_cast<char>(random_());
    return noise;
  }
  std::string spoilt;
  if (kind < 8) {
    spoilt = kind == 6 ? encoded(command()) : encoded(pointer());
  } else {
    spoilt = samples_[below(samples_.size())];
  }
  mutate(spoilt, random_);
  return spoilt;
}

}  // namespace layfigure::fuzz
