#include "layfigure/app/load_doll.h"

#include <unistd.h>

#include <stdexcept>

#include "layfigure/app/load_progress.h"
#include "layfigure/character/import.h"
#include "layfigure/doll/cached_build.h"
#include "layfigure/doll/settings.h"

namespace layfigure::app {

doll::Doll load_doll(const Options& options) {
  const doll::DollSettings settings =
      options.doll_settings ? doll::load_settings(*options.doll_settings) : doll::DollSettings{};
  const cache::DiskCache cache = cache::DiskCache::of_user();
  LoadProgress progress(STDERR_FILENO);
  progress.stage("reading " + options.character.filename().string());
  character::Rig rig = character::import_rig(options.character, cache);
  progress.stage("making the doll");
  try {
    return doll::build_doll(std::move(rig), settings, cache);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("character " + options.character.string() + ": " + error.what());
  }
}

}  // namespace layfigure::app
