#include "layfigure/doll/cached_build.h"

#include "layfigure/cache/bytes.h"

namespace layfigure::doll {
namespace {

constexpr const char* kCacheKind = "doll";

/// The doll in the cache, without its rig.
std::optional<Doll> find_doll(const cache::DiskCache& cache, const cache::Digest& key) try {
  const auto bytes = cache.find(kCacheKind, key);
  return bytes ? std::optional(cache::from_bytes<Doll>(*bytes)) : std::nullopt;
} catch (const std::exception&) {
  return std::nullopt;
}

}  // namespace

Doll build_doll(character::Rig rig, const DollSettings& settings, const cache::DiskCache& cache) {
  const cache::Digest key =
      cache::Digester().add(cache::to_bytes(rig.content_hash)).add(cache::to_bytes(settings)).value();
  std::optional<Doll> doll = find_doll(cache, key);
  if (!doll) {
    doll = build_doll(std::move(rig), settings);
    rig = std::exchange(doll->rig, {});  // it has an entry of its own
    cache.store(kCacheKind, key, cache::to_bytes(*doll));
  }
  doll->rig = std::move(rig);
  return *std::move(doll);
}

}  // namespace layfigure::doll
