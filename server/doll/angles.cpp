#include "angles.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace layfigure::doll {
namespace {

constexpr double kHalfTurnDeg = 180.0;
constexpr int kRoundings = 2;  // to_degrees() and to_radians() round twice each

}  // namespace

double to_radians(double degrees) { return degrees / kHalfTurnDeg * std::numbers::pi; }

double to_degrees(double radians) { return radians / std::numbers::pi * kHalfTurnDeg; }

std::optional<double> exact_degrees(double radians) {
  if (std::isinf(radians)) return std::copysign(kHalfTurnDeg, radians);
  const double near = to_degrees(radians);
  for (const double towards : {-1.0, 1.0}) {
    double degrees = near;
    for (int k = 0; k <= 2 * kRoundings; ++k) {
      if (to_radians(degrees) == radians) return degrees;
      degrees = std::nextafter(degrees, towards * std::numeric_limits<double>::infinity());
    }
  }
  return std::nullopt;
}

}  // namespace layfigure::doll
