#pragma once

#include <cstdint>

namespace layfigure::math {

/// A permutation of the 64-bit numbers that leaves none near its neighbours (Steele, Lea & Flood 2014, SplitMix64).
inline std::uint64_t scrambled(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

}  // namespace layfigure::math
