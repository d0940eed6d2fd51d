#include "byte_ring.h"

#include <algorithm>

namespace layfigure::messaging {

bool ByteRing::put(std::initializer_list<ByteView> pieces) noexcept {
  std::size_t head = head_.load(std::memory_order_relaxed);
  std::size_t room = bytes_.size() - (head - tail_.load(std::memory_order_acquire));
  for (const ByteView piece : pieces) {
    if (piece.size() > room) return false;
    room -= piece.size();
  }
  for (const ByteView piece : pieces) {
    const std::size_t at = head % bytes_.size();
    const std::size_t before_end = std::min(piece.size(), bytes_.size() - at);
    std::copy_n(piece.begin(), before_end, bytes_.begin() + static_cast<std::ptrdiff_t>(at));
    std::copy(piece.begin() + static_cast<std::ptrdiff_t>(before_end), piece.end(), bytes_.begin());
    head += piece.size();
  }
  head_.store(head, std::memory_order_release);
  return true;
}

void ByteRing::take(Bytes& out) {
  const std::size_t tail = tail_.load(std::memory_order_relaxed);
  const std::size_t head = head_.load(std::memory_order_acquire);
  const std::size_t at = tail % bytes_.size();
  const std::size_t before_end = std::min(head - tail, bytes_.size() - at);
  const auto first = bytes_.begin() + static_cast<std::ptrdiff_t>(at);
  out.insert(out.end(), first, first + static_cast<std::ptrdiff_t>(before_end));
  out.insert(out.end(), bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(head - tail - before_end));
  tail_.store(head, std::memory_order_release);
}

}  // namespace layfigure::messaging
