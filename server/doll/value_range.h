#pragma once

#include <string>
#include <string_view>

namespace layfigure::doll {

/// Of a number in a settings file.
struct ValueRange {
  double least{0.0};
  double most{0.0};
  bool least_allowed{true};
};

constexpr double kMostOfAny = 1e12;  ///< above any material's; keeps products of numbers finite

/// "" if the value is in the range, else one line: `name = value, expected [least, most]`.
[[nodiscard]] std::string range_complaint(std::string_view name, double value, const ValueRange& range);

}  // namespace layfigure::doll
