#pragma once

#include <array>

#include "eight.h"

namespace layfigure::spidar {

using Six = std::array<double, 6>;
using SixColumns = std::array<Eight, 6>;
using StringNumbers = std::array<double, kStrings>;

inline StringNumbers numbers(const Eight& x) {
  StringNumbers result;
  store_eight(x, result.data());
  return result;
}

/// sum over k of columns[k] * factors[k]
inline Eight combined(const SixColumns& columns, const Six& factors) {
  Eight sum = columns[0] * factors[0];
  for (int k = 1; k < 6; ++k) sum = sum + columns[k] * factors[k];
  return sum;
}

/// The product of each column with x.
inline Six products(const SixColumns& columns, const Eight& x) {
  const math::Lanes4 first = totals(columns[0] * x, columns[1] * x, columns[2] * x, columns[3] * x);
  const math::Lanes4 last = totals(columns[4] * x, columns[5] * x, columns[4] * x, columns[5] * x);
  return {first.v[0], first.v[1], first.v[2], first.v[3], last.v[0], last.v[1]};
}

struct Range {
  double low, high;
};

inline bool is_within(const Eight& t, const Range& range) { return least(t) >= range.low && most(t) <= range.high; }

}  // namespace layfigure::spidar
