#pragma once

#include <string>
#include <vector>

#include <toml++/toml.h>

#include "layfigure/doll/joint_override.h"

namespace layfigure::doll {

/// Throws SettingsError: `file:line: why`.
[[noreturn]] void refuse(const std::string& file, const toml::source_region& where, const std::string& why);

/// Reads the tables [joints."PATTERN"] of a settings file, in the order of the file. Throws SettingsError.
[[nodiscard]] std::vector<JointOverride> read_joint_tables(const std::string& file, const toml::node& joints);

}  // namespace layfigure::doll
