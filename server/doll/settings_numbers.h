#pragma once

#include <string>
#include <vector>

#include "layfigure/doll/settings.h"

namespace layfigure::doll {

struct SettingsNumber {
  std::string name;
  double value{0.0};
  int line{0};  ///< of the settings file; 0: the default
};

/// The numbers that hold for the whole doll, by the names that a settings file gives them.
[[nodiscard]] std::vector<SettingsNumber> numbers_of(const DollSettings& settings);

}  // namespace layfigure::doll
