#pragma once

namespace layfigure::character {

inline constexpr double kInch = 0.0254;  // [m]

/// Which unit a file was in after all, judged by the character's size.
///
/// A doll has a sane size where its longest side is 0.1 to 10 m. A file that is not so large in its format's usual unit
/// is in the first of metres, centimetres and millimetres that makes it so. A file that states its unit is believed
/// from 0.03 to 100 m: there are dragons and beetles, but a man of 2 cm or 180 m is one whose exporter left the unit
/// alone.
struct UnitChoice {
  double metres_per_unit{1.0};
  bool fits{true};  ///< false: no unit makes its size sane, and it stays as it was
};

/// `size`: its longest side in the unit at hand [m], which is `metres_per_unit`.
[[nodiscard]] UnitChoice choose_unit(double size, double metres_per_unit, bool is_stated);

}  // namespace layfigure::character
