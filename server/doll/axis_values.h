#pragma once

#include <Eigen/Core>
#include <optional>

namespace layfigure::doll {

/// A joint's law has one number for its unit axis and each axis' multiple of it; here are the values of the axes
/// themselves, which people think in.

/// unit * ratios; an infinite one is that of its axis, whatever the other.
[[nodiscard]] Eigen::Vector3d axis_values(double unit, const Eigen::Vector3d& ratios);

/// The unit is the smallest of the values, which are >= 0; where that is none, the largest. Equal ones have the same
/// ratio, infinite and vanishing ones too.
void set_axis_values(const Eigen::Vector3d& values, double& unit, Eigen::Vector3d& ratios);

/// The values of which set_axis_values() makes just this unit and these ratios. Nothing if there are none: then the
/// unit alone was set.
[[nodiscard]] std::optional<Eigen::Vector3d> exact_axis_values(double unit, const Eigen::Vector3d& ratios);

}  // namespace layfigure::doll
