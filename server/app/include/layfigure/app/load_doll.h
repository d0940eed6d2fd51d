#pragma once

#include <filesystem>

#include "layfigure/app/options.h"
#include "layfigure/doll/doll.h"

namespace layfigure::app {

/// The doll of options.character by options.doll_settings or, if these are not named, by the settings beside the
/// character, which is then logged; from the user's cache where it was made before. Shows its progress on stderr if
/// that is a terminal. Throws what import_rig(), load_settings() and build_doll() throw. Before there are other
/// threads.
[[nodiscard]] doll::Doll load_doll(const Options& options);
/// The same of that character by these settings.
[[nodiscard]] doll::Doll load_doll(const std::filesystem::path& character, const doll::DollSettings& settings);

}  // namespace layfigure::app
