#pragma once

#include <optional>

namespace layfigure::doll {

/// -180 and 180 become -pi and pi exactly.
[[nodiscard]] double to_radians(double degrees);
[[nodiscard]] double to_degrees(double radians);

/// The degrees of which to_radians() makes just these radians; infinite ones are half turns. Nothing if no double does.
[[nodiscard]] std::optional<double> exact_degrees(double radians);

}  // namespace layfigure::doll
