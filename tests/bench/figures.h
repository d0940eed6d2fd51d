#pragma once

#include <optional>
#include <span>
#include <string>

/// What a subject of the benchmark found, told in one way for all of them.
namespace layfigure::bench {

struct Figure {
  std::string name;
  double value;
  std::string unit;                ///< empty: a number
  std::optional<double> target{};  ///< the largest value allowed, where there is one
};

/// The value is finite and at most the target. A figure without a target holds.
[[nodiscard]] bool holds(const Figure& figure);

/// Prints a table, or with `json` a list of {"name", "value", "unit", "target", "holds"}; what is not finite is null.
void print(std::span<const Figure> figures, bool json);

}  // namespace layfigure::bench
