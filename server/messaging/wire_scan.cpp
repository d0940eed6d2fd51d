#include "wire_scan.h"

namespace layfigure::messaging {

void WireScan::skip(std::size_t size) {
  ok_ = ok_ && size <= bytes_.size() - at_;
  if (ok_) at_ += size;
}

std::int32_t WireScan::read_int() {
  const std::size_t begin = at_;
  skip(4);
  std::uint32_t value = 0;
  for (std::size_t i = 0; ok_ && i < 4; ++i) value = (value << 8) | bytes_[begin + i];
  return static_cast<std::int32_t>(value);
}

std::size_t WireScan::count(std::size_t max) {
  const std::int32_t value = read_int();
  ok_ = ok_ && value >= 0 && static_cast<std::size_t>(value) <= max;
  return ok_ ? static_cast<std::size_t>(value) : 0;
}

void WireScan::skip_string(std::size_t max) {
  const std::size_t length = count(max + 1);
  ok_ = ok_ && length >= 1;
  skip(length);
  ok_ = ok_ && bytes_[at_ - 1] == 0;
}

}  // namespace layfigure::messaging
