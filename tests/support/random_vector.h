#pragma once

#include <Eigen/Core>
#include <random>

namespace layfigure::testing {

/// Each component evenly within +- extent.
[[nodiscard]] inline Eigen::Vector3d random_vector(std::mt19937& generator, double extent) {
  std::uniform_real_distribution<double> component(-extent, extent);
  const double x = component(generator);
  const double y = component(generator);
  const double z = component(generator);
  return {x, y, z};
}

}  // namespace layfigure::testing
