#include "mutate.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstring>

namespace layfigure::fuzz {
namespace {

using Random = std::mt19937_64;

constexpr std::size_t kLongestBlock = 512;
constexpr std::array<std::uint32_t, 10> kExtremes{0,          1,          0x7F,       0xFFFF,     0x7FFFFFFF,
                                                  0x80000000, 0xFFFFFFFF, 0x7FC00000, 0x7F800000, 0x7F7FFFFF};
constexpr std::array<const char*, 10> kWrittenExtremes{"0",     "-1",  "1e39",       "nan",        "-inf",
                                                       "1e999", "255", "4294967295", "2147483648", "0.0000000000001"};

/// In [0, count); 0 if that is empty.
std::size_t below(std::size_t count, Random& random) { return count == 0 ? 0 : random() % count; }

void cut(std::string& bytes, Random& random) { bytes.resize(below(bytes.size(), random) + 1); }

void flip(std::string& bytes, Random& random) {
  for (std::size_t count = 1 + below(8, random); count > 0; --count) {
    char& byte = bytes[below(bytes.size(), random)];
    byte = static_cast<char>(byte ^ static_cast<char>(1U << below(8, random)));
  }
}

void overwrite(std::string& bytes, Random& random) {
  const std::size_t at = below(bytes.size(), random);
  const std::size_t length = std::min(1 + below(16, random), bytes.size() - at);
  for (std::size_t k = 0; k < length; ++k) bytes[at + k] = static_cast<char>(random());
}

void put_extreme(std::string& bytes, Random& random) {
  const std::uint32_t value = kExtremes[below(kExtremes.size(), random)];
  if (bytes.size() < sizeof value) return;
  std::memcpy(bytes.data() + below(bytes.size() - sizeof value + 1, random), &value, sizeof value);
}

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

void write_extreme(std::string& bytes, Random& random) {
  const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size(), random));
  const auto digit = std::find_if(from, bytes.end(), is_digit);
  const auto end = std::find_if_not(digit, bytes.end(), is_digit);
  bytes.replace(digit, end, kWrittenExtremes[below(kWrittenExtremes.size(), random)]);
}

/// Copies, moves or removes a block.
void move_block(std::string& bytes, Random& random) {
  const std::size_t at = below(bytes.size(), random);
  const std::string block = bytes.substr(at, 1 + below(kLongestBlock, random));
  const std::size_t kind = below(3, random);
  if (kind > 0) bytes.erase(at, block.size());
  if (kind < 2) bytes.insert(below(bytes.size() + 1, random), block);
}

}  // namespace

void mutate(std::string& bytes, Random& random) {
  constexpr std::array kWays{cut,         flip,          flip,          overwrite, put_extreme,
                             put_extreme, write_extreme, write_extreme, move_block};
  for (std::size_t count = 1 + below(4, random); count > 0 && !bytes.empty(); --count) {
    kWays[below(kWays.size(), random)](bytes, random);
  }
}

}  // namespace layfigure::fuzz
