#pragma once

#include <filesystem>
#include <string>

#include "layfigure/doll/doll.h"

namespace layfigure::doll {

/// A settings file with every value that the doll was built with, and why behind each. load_settings() and build_doll()
/// make the same doll of it, bit for bit, of the same character.
[[nodiscard]] std::string settings_text(const Doll& doll);

/// Writes settings_text() into a file, which is whole or not there. Throws SettingsError: there is such a file already
/// and it may not be replaced; it cannot be written.
void write_settings(const Doll& doll, const std::filesystem::path& path, bool may_replace);

}  // namespace layfigure::doll
