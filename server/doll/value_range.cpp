#include "value_range.h"

#include <sstream>

namespace layfigure::doll {

std::string range_complaint(std::string_view name, double value, const ValueRange& range) {
  const bool enough = range.least_allowed ? value >= range.least : value > range.least;
  if (enough && value <= range.most) return {};
  std::ostringstream text;
  text << name << " = " << value << ", expected " << (range.least_allowed ? '[' : '(') << range.least << ", "
       << range.most << ']';
  return text.str();
}

}  // namespace layfigure::doll
