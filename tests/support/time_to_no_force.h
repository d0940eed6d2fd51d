#pragma once

#include <cmath>
#include <iostream>
#include <string_view>

namespace layfigure::testing {

/// Writes to the test's log how long after a fault showed [s] there was no force any more, which the tests only bound;
/// not above 0: the force had gone before.
inline void tell_time_to_no_force(std::string_view fault, double seconds) {
  if (seconds > 0.0) {
    std::cout << "no force " << std::round(1e5 * seconds) / 100.0 << " ms after: " << fault << "\n";
  } else {
    std::cout << "no force when it showed, or before: " << fault << "\n";
  }
}

}  // namespace layfigure::testing
