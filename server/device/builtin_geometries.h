#pragma once

#include <string_view>
#include <vector>

namespace layfigure::device {

/// A geometry file of assets/spidar, within the program: an installed server has no folder to look in.
struct BuiltinGeometry {
  std::string_view name;  ///< as --device names it
  std::string_view text;
};

[[nodiscard]] const std::vector<BuiltinGeometry>& builtin_geometries();

}  // namespace layfigure::device
