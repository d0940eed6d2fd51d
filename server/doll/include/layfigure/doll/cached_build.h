#pragma once

#include "layfigure/cache/disk_cache.h"
#include "layfigure/doll/build.h"

namespace layfigure::doll {

/// build_doll(), or what it made of the same rig with the same settings before.
[[nodiscard]] Doll build_doll(character::Rig rig, const DollSettings& settings, const cache::DiskCache& cache);

}  // namespace layfigure::doll
