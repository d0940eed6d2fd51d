#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "layfigure/cache/digest.h"

namespace layfigure::cache {

/// Results of slow computations as files in a folder, found by what they were computed from. Nothing depends on it:
/// whatever goes wrong (no folder, a full or read-only disk, a broken or half-written entry) is a result that is not
/// found. An entry is written under another name and renamed, so that any number of processes can use the folder at
/// once, and is read with its checksum. One program's entries are not another's: a program that was built anew, though
/// it has the same version, finds none of those that it made before.
///
/// When the folder has grown over its bound, the entries that were not used for the longest time are removed.
class DiskCache {
 public:
  static constexpr std::uintmax_t kMostBytes = 512ULL << 20U;  ///< of all entries; a character takes 1 to 20 MB

  /// Holds nothing and keeps nothing.
  DiskCache() = default;
  /// In `folder`, which is made when the first entry is stored.
  explicit DiskCache(std::filesystem::path folder, std::uintmax_t most_bytes = kMostBytes);
  /// In layfigure/ below $XDG_CACHE_HOME, else below $HOME/.cache; without either, DiskCache().
  [[nodiscard]] static DiskCache of_user();

  /// The bytes that were stored under `kind` (a word of letters: what they are) and `key` (what they were made of).
  /// O(bytes).
  [[nodiscard]] std::optional<std::string> find(std::string_view kind, const Digest& key) const;

  /// Keeps `bytes`. Not if they are more than a quarter of what the folder may hold. O(bytes + entries).
  void store(std::string_view kind, const Digest& key, std::string_view bytes) const;

 private:
  [[nodiscard]] std::filesystem::path entry_path(std::string_view kind, const Digest& key) const;
  void remove_oldest() const;

  std::filesystem::path folder_;  // empty: no cache
  std::uintmax_t most_bytes_{0};
  Digest program_;
};

}  // namespace layfigure::cache
