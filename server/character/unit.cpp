#include "unit.h"

#include <initializer_list>

namespace layfigure::character {
namespace {

struct Range {
  double least;
  double most;
  [[nodiscard]] bool contains(double size) const { return size >= least && size <= most; }
};

constexpr Range kSane{0.1, 10.0};          // [m]
constexpr Range kBelievable{0.03, 100.0};  // [m]

}  // namespace

UnitChoice choose_unit(double size, double metres_per_unit, bool is_stated) {
  if ((is_stated ? kBelievable : kSane).contains(size)) return {metres_per_unit, true};
  const double units = size / metres_per_unit;
  for (const double candidate : {1.0, 0.01, 0.001}) {
    if (kSane.contains(candidate * units)) return {candidate, true};
  }
  return {metres_per_unit, false};
}

}  // namespace layfigure::character
