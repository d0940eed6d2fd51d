#include "layfigure/app/load_doll.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <stdexcept>
#include <utility>

#include "layfigure/app/load_progress.h"
#include "layfigure/character/import.h"
#include "layfigure/doll/cached_build.h"
#include "layfigure/doll/settings.h"

namespace layfigure::app {
namespace {

doll::DollSettings find_settings(const Options& options) {
  if (options.doll_settings) return doll::load_settings(*options.doll_settings);
  const std::filesystem::path beside = doll::settings_path_beside(options.character);
  std::error_code unreadable;
  if (!std::filesystem::exists(beside, unreadable)) return {};
  spdlog::info("using the settings beside the character: {}", beside.string());
  return doll::load_settings(beside);
}

}  // namespace

doll::Doll load_doll(const Options& options) { return load_doll(options.character, find_settings(options)); }

doll::Doll load_doll(const std::filesystem::path& character, const doll::DollSettings& settings) {
  const cache::DiskCache cache = cache::DiskCache::of_user();
  LoadProgress progress(STDERR_FILENO);
  progress.stage("reading " + character.filename().string());
  layfigure::character::Rig rig = layfigure::character::import_rig(character, cache);
  progress.stage("making the doll");
  try {
    return doll::build_doll(std::move(rig), settings, cache);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("character " + character.string() + ": " + error.what());
  }
}

}  // namespace layfigure::app
