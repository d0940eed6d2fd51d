#include "axis_values.h"

#include <array>
#include <cmath>
#include <limits>

namespace layfigure::doll {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The value nearest to unit * ratio whose quotient by the unit is the ratio. The product is off by one rounding, and
/// so is the quotient.
std::optional<double> exact_multiple(double unit, double ratio) {
  const double near = unit * ratio;
  for (const double value : {near, std::nextafter(near, 0.0), std::nextafter(near, kInfinity)}) {
    if (value / unit == ratio) return value;
  }
  return std::nullopt;
}

}  // namespace

Vector3d axis_values(double unit, const Vector3d& ratios) {
  return ratios.unaryExpr(
      [&](double ratio) { return std::isinf(ratio) || std::isinf(unit) ? kInfinity : unit * ratio; });
}

void set_axis_values(const Vector3d& values, double& unit, Vector3d& ratios) {
  unit = values.minCoeff() > 0.0 ? values.minCoeff() : values.maxCoeff();
  for (int k = 0; k < 3; ++k) ratios[k] = values[k] == unit ? 1.0 : values[k] / unit;
}

std::optional<Vector3d> exact_axis_values(double unit, const Vector3d& ratios) {
  if (!(unit > 0.0) || std::isinf(unit)) return std::nullopt;
  Vector3d values;
  for (int k = 0; k < 3; ++k) {
    const std::optional<double> value = std::isinf(ratios[k]) ? kInfinity : exact_multiple(unit, ratios[k]);
    if (!value) return std::nullopt;
    values[k] = *value;
  }
  double same_unit = 0.0;
  Vector3d same_ratios;
  set_axis_values(values, same_unit, same_ratios);
  return same_unit == unit && same_ratios == ratios ? std::optional(values) : std::nullopt;
}

}  // namespace layfigure::doll
