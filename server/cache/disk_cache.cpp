#include "layfigure/cache/disk_cache.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <system_error>
#include <vector>

namespace layfigure::cache {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr std::string_view kSuffix = ".entry";
constexpr std::string_view kUnfinished = ".new";
constexpr auto kAbandoned = 1h;              // age of an unfinished entry whose writer must be gone
constexpr std::uintmax_t kLargestShare = 4;  // an entry is at most 1 / this of the bound

/// What every entry begins with, in this machine's byte order; the payload follows.
struct Header {
  char magic[8] = {'L', 'F', 'C', 'A', 'C', 'H', 'E', '1'};
  std::uint64_t size{0};  ///< of the payload
  Digest checksum;        ///< of the payload
};
static_assert(sizeof(Header) == 32);

/// The payload of a whole entry, or nothing.
std::optional<std::string> read_entry(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  Header header;
  if (!file.read(reinterpret_cast<char*>(&header), sizeof header)) return std::nullopt;
  if (std::memcmp(header.magic, Header{}.magic, sizeof header.magic) != 0) return std::nullopt;
  if (header.size != fs::file_size(path) - sizeof header) return std::nullopt;
  std::string payload(header.size, '\0');
  if (!file.read(payload.data(), static_cast<std::streamsize>(payload.size()))) return std::nullopt;
  if (digest_of(payload) != header.checksum) return std::nullopt;
  return payload;
}

bool write_all(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

/// Writes a whole entry to a new file beside `path` and returns its name; nothing, and no file, if that fails.
std::optional<fs::path> write_entry(const fs::path& path, std::string_view payload) {
  std::string name = path.string() + ".XXXXXX" + std::string(kUnfinished);
  const int file = ::mkostemps(name.data(), static_cast<int>(kUnfinished.size()), O_CLOEXEC);
  if (file < 0) return std::nullopt;
  Header header;
  header.size = payload.size();
  header.checksum = digest_of(payload);
  const bool whole =
      write_all(file, {reinterpret_cast<const char*>(&header), sizeof header}) && write_all(file, payload);
  if (::close(file) == 0 && whole) return name;  // a full disk may say so only on closing
  std::error_code ignored;
  fs::remove(name, ignored);
  return std::nullopt;
}

fs::path user_folder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && fs::path(cache).is_absolute()) {
    return fs::path(cache) / "layfigure";
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && fs::path(home).is_absolute()) {
    return fs::path(home) / ".cache" / "layfigure";
  }
  return {};
}

}  // namespace

DiskCache::DiskCache(fs::path folder, std::uintmax_t most_bytes) : folder_(std::move(folder)), most_bytes_(most_bytes) {
  if (folder_.empty()) return;
  if (const auto program = digest_of_file("/proc/self/exe")) {
    program_ = *program;
  } else {
    folder_.clear();  // entries of this program could not be told from another's
  }
}

DiskCache DiskCache::of_user() { return DiskCache(user_folder()); }

fs::path DiskCache::entry_path(std::string_view kind, const Digest& key) const {
  std::string name(kind);
  return folder_ / (name + "-" + Digester().add(program_).add(key).value().hex() + std::string(kSuffix));
}

std::optional<std::string> DiskCache::find(std::string_view kind, const Digest& key) const try {
  if (folder_.empty()) return std::nullopt;
  const fs::path path = entry_path(kind, key);
  std::optional<std::string> payload = read_entry(path);
  std::error_code ignored;
  if (payload) {
    fs::last_write_time(path, fs::file_time_type::clock::now(), ignored);
  } else {
    fs::remove(path, ignored);
  }
  return payload;
} catch (const std::exception&) {
  return std::nullopt;
}

void DiskCache::store(std::string_view kind, const Digest& key, std::string_view bytes) const try {
  if (folder_.empty() || bytes.size() > most_bytes_ / kLargestShare) return;
  const fs::path path = entry_path(kind, key);
  fs::create_directories(folder_);
  const std::optional<fs::path> written = write_entry(path, bytes);
  if (!written) return;
  fs::rename(*written, path);
  remove_oldest();
} catch (const std::exception&) {
}

void DiskCache::remove_oldest() const {
  struct Entry {
    fs::file_time_type used;
    fs::path path;
    std::uintmax_t size;
  };
  std::vector<Entry> entries;
  std::uintmax_t total = 0;
  for (const fs::directory_entry& file : fs::directory_iterator(folder_)) {
    std::error_code gone;  // another process may be removing it
    const Entry entry{file.last_write_time(gone), file.path(), file.file_size(gone)};
    if (gone) continue;
    if (entry.path.extension() == kUnfinished && fs::file_time_type::clock::now() - entry.used > kAbandoned) {
      fs::remove(entry.path, gone);
    }
    if (entry.path.extension() != kSuffix) continue;
    entries.push_back(entry);
    total += entry.size;
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.used < b.used; });
  for (const Entry& entry : entries) {
    if (total <= most_bytes_) return;
    std::error_code ignored;
    fs::remove(entry.path, ignored);
    total -= entry.size;
  }
}

}  // namespace layfigure::cache
