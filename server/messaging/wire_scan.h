#pragma once

#include <cstddef>
#include <cstdint>

#include "layfigure/messaging/codec.h"

namespace layfigure::messaging {

/// Reads LCM's encoding without building anything, to learn whether the lengths in a message are true before the
/// generated decoder believes them: it would reserve what a hostile length asks for, and throw on a negative one. After
/// the first failure every read fails.
class WireScan {
 public:
  explicit WireScan(ByteView bytes) : bytes_(bytes) {}

  void skip(std::size_t size);
  /// A count of at most `max`; 0 after a failure.
  std::size_t count(std::size_t max);
  /// A length of at most `max` + 1 for the terminating zero, and so many bytes.
  void skip_string(std::size_t max);
  /// True if nothing failed and no byte is left over.
  [[nodiscard]] bool complete() const { return ok_ && at_ == bytes_.size(); }

 private:
  [[nodiscard]] std::int32_t read_int();

  ByteView bytes_;
  std::size_t at_{0};
  bool ok_{true};
};

}  // namespace layfigure::messaging
