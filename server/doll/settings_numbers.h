#pragma once

#include <string>
#include <vector>

#include "layfigure/doll/settings.h"

namespace layfigure::doll {

struct SettingsNumber {
  std::string name;
  double value{0.0};
  std::string why;  ///< "material soft vinyl", "line 12 of the settings" or "default"
};

/// Why one of them is what it is; the material too has a name: "material".
[[nodiscard]] std::string why_of_number(const DollSettings& settings, const std::string& name);

/// The numbers that hold for the whole doll, by the names that a settings file gives them.
[[nodiscard]] std::vector<SettingsNumber> numbers_of(const DollSettings& settings);

}  // namespace layfigure::doll
