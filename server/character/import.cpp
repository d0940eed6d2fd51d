#include "layfigure/character/import.h"

#include <optional>
#include <string>

#include "companion.h"
#include "convert.h"
#include "file_check.h"
#include "isolate.h"
#include "rig_bytes.h"
#include "source_reader.h"
#include "text.h"

namespace layfigure::character {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCacheKind = "rig";

/// What a reader may take. The largest character that is allowed needs a tenth of the time, and most of the memory.
constexpr std::uint64_t kMostMemory = 4ULL << 30U;    // [bytes]
constexpr std::uint64_t kLeastSeconds = 20;           // of CPU time, whatever the file's size
constexpr std::uint64_t kSlowestReading = 4'000'000;  // [bytes/s]; text that is parsed slowly makes twice that

ChildLimits limits_for(const fs::path& path) {
  return {kLeastSeconds + fs::file_size(path) / kSlowestReading, kMostMemory};
}

std::string import_in_child(const fs::path& path) {
  const Reading reading = read_source(path);
  return to_bytes(ImportRecord{convert(reading.scene), reading.companions, reading.digest});
}

/// assimp crashes on some broken files, so it reads in a process of its own.
std::string import_isolated(const fs::path& path) {
  return run_isolated([&] { return import_in_child(path); }, limits_for(path));
}

/// Of all that decides what is read: the file, its name's ending, which tells readers the format, and the reader; the
/// cache adds this program.
cache::Digest cache_key(const fs::path& path, const cache::Digest& file) {
  const std::string ending = path.extension().string();
  return cache::Digester().add(file).add(reader_version()).add("\n").add(ending).value();
}

fs::path folder_of(const fs::path& path) { return fs::absolute(path).parent_path(); }

/// What is not UTF-8, or holds control characters, would be another folder if it were made so.
std::string readable_or_nothing(std::string text) { return make_readable(text) ? std::string() : text; }

bool are_unchanged(const std::vector<Companion>& companions, const fs::path& folder) {
  for (const Companion& companion : companions) {
    if (!is_unchanged(companion, folder)) return false;
  }
  return true;
}

/// The rig in the cache, if the files beside the character's are as they were.
std::optional<Rig> find_rig(const fs::path& path, const cache::DiskCache& cache) try {
  const auto digest = cache::digest_of_file(path);
  if (!digest) return std::nullopt;
  const auto bytes = cache.find(kCacheKind, cache_key(path, *digest));
  if (!bytes) return std::nullopt;
  ImportRecord record = from_bytes(*bytes);
  if (!are_unchanged(record.companions, folder_of(path))) return std::nullopt;
  return std::move(record.rig);
} catch (const std::exception&) {
  return std::nullopt;
}

Rig import_and_store(const fs::path& path, const cache::DiskCache& cache) {
  const std::string bytes = import_isolated(path);
  ImportRecord record = from_bytes(bytes);
  if (record.digest) cache.store(kCacheKind, cache_key(path, *record.digest), bytes);
  return std::move(record.rig);
}

}  // namespace

Rig import_rig(const fs::path& path, const cache::DiskCache& cache) {
  check_file(path);
  try {
    std::optional<Rig> found = find_rig(path, cache);
    Rig rig = found ? *std::move(found) : import_and_store(path, cache);
    rig.name = one_line(path.stem().string());
    rig.source_file = one_line(path.filename().string());
    rig.source_folder = readable_or_nothing(fs::canonical(folder_of(path)).string());
    return rig;
  } catch (const std::exception& error) {
    throw ImportError("character " + path.string() + ": " + one_line(error.what()));
  }
}

}  // namespace layfigure::character
