#pragma once

#include <array>
#include <string_view>

namespace layfigure::doll {

/// As settings files call them.
constexpr std::array<std::string_view, 3> kAxisNames{"twist", "bend_y", "bend_z"};
constexpr std::array<std::string_view, 3> kShapeNames{"hull", "capsule", "none"};  ///< in ShapeKind's order

}  // namespace layfigure::doll
