#pragma once

#include <atomic>
#include <cstddef>
#include <initializer_list>

#include "layfigure/messaging/codec.h"

namespace layfigure::messaging {

/// A first-in-first-out ring of bytes from one thread, which put()s, to another, which take()s: neither ever waits for
/// the other. All memory is there from the beginning. What one put() has put is taken whole or not yet.
///
/// Head and tail only grow; a byte lies at its count modulo the capacity (Lamport's queue).
class ByteRing {
 public:
  /// `capacity` [bytes], > 0.
  explicit ByteRing(std::size_t capacity) : bytes_(capacity) {}

  /// Appends the pieces one after the other. False, and nothing has changed, if there is no room for all of them.
  /// Allocates, locks and throws nothing; O(bytes).
  [[nodiscard]] bool put(std::initializer_list<ByteView> pieces) noexcept;

  /// Appends all that the ring holds to `out`, and empties it. O(bytes); allocates in `out`.
  void take(Bytes& out);

 private:
  static constexpr std::size_t kCacheLine = 64;  // [bytes]: the threads' counts do not share one

  Bytes bytes_;
  alignas(kCacheLine) std::atomic<std::size_t> head_{0};  ///< bytes put so far
  alignas(kCacheLine) std::atomic<std::size_t> tail_{0};  ///< bytes taken so far
};

}  // namespace layfigure::messaging
