#pragma once

#include <cstdint>
#include <layfigure/command_t.hpp>
#include <layfigure/pointer_t.hpp>
#include <random>
#include <string>
#include <vector>

#include "layfigure/messaging/codec.h"

namespace layfigure::fuzz {

/// Makes what a client might send, in good faith or ill will, from a seed: the same seed, the same messages.
class RandomMessages {
 public:
  explicit RandomMessages(std::uint64_t seed);

  /// A command of a name that there is, mostly, with arguments of names and values that there are, often.
  [[nodiscard]] command_t command();
  [[nodiscard]] pointer_t pointer();
  /// Bytes: a command or a pointer as it is, a message of any type of the protocol spoilt, or mere noise.
  [[nodiscard]] std::string bytes();
  /// A number that often has a meaning, and often none: nan, infinite, huge.
  [[nodiscard]] double number();
  [[nodiscard]] std::mt19937_64& random() { return random_; }

 private:
  [[nodiscard]] std::size_t below(std::size_t count) { return random_() % count; }
  [[nodiscard]] bool once_in(std::size_t times) { return below(times) == 0; }
  [[nodiscard]] std::string text();
  [[nodiscard]] argument_t argument(const std::string& name);
  [[nodiscard]] std::string client_id();

  std::mt19937_64 random_;
  std::vector<std::string> samples_;  ///< one message of each type, encoded
  std::int64_t sequence_{0};
};

}  // namespace layfigure::fuzz
