#include "layfigure/session/snapshots.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>

#include "layfigure/cache/bytes.h"
#include "layfigure/cache/digest.h"

namespace layfigure::session {
namespace {

namespace fs = std::filesystem;

/// Names the layout of what follows: DollMemory's fields among it. Another layout gets another number.
constexpr std::string_view kMagic = "LFSNAP01";

struct Content {
  std::vector<std::string> bodies;  ///< names, of the doll that they are of
  std::vector<std::pair<std::string, haptics::DollMemory>> snapshots;
};

std::vector<std::string> body_names(const doll::Doll& doll) {
  std::vector<std::string> names;
  for (const dynamics::BodyDefinition& body : doll.definition.bodies) names.push_back(body.name);
  return names;
}

SnapshotError cannot_write(const fs::path& file, int error) {
  return SnapshotError("cannot write the snapshots '" + file.string() + "': " + std::strerror(error));
}

/// Held by who changes the file.
class Lock {
 public:
  explicit Lock(const fs::path& file)
      : lock_(::open((file.string() + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {
    if (lock_ < 0) throw cannot_write(file, errno);
    while (::flock(lock_, LOCK_EX) != 0 && errno == EINTR) continue;
  }
  ~Lock() { ::close(lock_); }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

 private:
  int lock_;
};

void write_all(int file, std::string_view bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw cannot_write(path, errno);
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
}

void replace_file(const fs::path& path, std::string_view bytes) {
  std::string name = path.string() + ".XXXXXX";
  const int file = ::mkostemp(name.data(), O_CLOEXEC);
  if (file < 0) throw cannot_write(path, errno);
  try {
    write_all(file, bytes, path);
    if (::rename(name.c_str(), path.c_str()) != 0) throw cannot_write(path, errno);
  } catch (...) {
    ::close(file);
    ::unlink(name.c_str());
    throw;
  }
  ::close(file);
}

}  // namespace

fs::path SnapshotFile::of_user(const doll::Doll& doll) {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (state != nullptr && fs::path(state).is_absolute()) {
    folder = state;
  } else if (home != nullptr && fs::path(home).is_absolute()) {
    folder = fs::path(home) / ".local" / "state";
  } else {
    return {};
  }
  char name[40];
  std::snprintf(name, sizeof name, "%016llx.snapshots", static_cast<unsigned long long>(doll.rig.content_hash));
  return folder / "layfigure" / name;
}

std::vector<SnapshotFile::Named> SnapshotFile::read() const {
  std::error_code unreadable;
  if (file_.empty() || !fs::exists(file_, unreadable)) return {};
  std::ifstream stream(file_, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) throw SnapshotError("cannot read the snapshots '" + file_.string() + "'");
  constexpr std::size_t kHeader = kMagic.size() + sizeof(cache::Digest);
  const std::string mend = "; move the file away to begin anew";
  if (bytes.size() < kHeader || !bytes.starts_with(kMagic)) {
    throw SnapshotError("'" + file_.string() + "' holds no snapshots of this version" + mend);
  }
  cache::Digest digest;
  std::memcpy(&digest, bytes.data() + kMagic.size(), sizeof digest);
  const std::string_view payload = std::string_view(bytes).substr(kHeader);
  if (cache::digest_of(payload) != digest) throw SnapshotError("'" + file_.string() + "' is damaged" + mend);
  Content content;
  try {
    content = cache::from_bytes<Content>(payload);
  } catch (const std::runtime_error&) {
    throw SnapshotError("'" + file_.string() + "' is damaged" + mend);
  }
  if (content.bodies != body_names(*doll_)) {
    throw SnapshotError("the snapshots '" + file_.string() + "' are of " + std::to_string(content.bodies.size()) +
                        " other bodies than this doll's " + std::to_string(doll_->definition.bodies.size()) +
                        ": its settings merge bones in another way" + mend);
  }
  return std::move(content.snapshots);
}

void SnapshotFile::write(const std::vector<Named>& snapshots) const {
  const std::string payload = cache::to_bytes(Content{body_names(*doll_), snapshots});
  const cache::Digest digest = cache::digest_of(payload);
  std::string bytes(kMagic);
  bytes.append(reinterpret_cast<const char*>(&digest), sizeof digest);
  replace_file(file_, bytes + payload);
}

std::vector<std::string> SnapshotFile::names() {
  std::vector<std::string> names;
  for (const Named& snapshot : read()) names.push_back(snapshot.first);
  return names;
}

std::optional<haptics::DollMemory> SnapshotFile::find(const std::string& name) {
  std::vector<Named> all = read();
  const auto found = std::ranges::find(all, name, &Named::first);
  return found == all.end() ? std::nullopt : std::optional(std::move(found->second));
}

void SnapshotFile::save(const std::string& name, const haptics::DollMemory& memory) {
  if (file_.empty()) throw SnapshotError("there is no place for snapshots: set HOME or XDG_STATE_HOME");
  std::error_code failed;
  fs::create_directories(file_.parent_path(), failed);
  if (failed) throw cannot_write(file_, failed.value());
  const Lock lock(file_);
  std::vector<Named> all = read();
  if (const auto found = std::ranges::find(all, name, &Named::first); found != all.end()) {
    found->second = memory;
  } else if (all.size() < kMost) {
    all.emplace_back(name, memory);
  } else {
    throw SnapshotError("there are " + std::to_string(kMost) + " snapshots already; remove one first");
  }
  write(all);
}

bool SnapshotFile::remove(const std::string& name) {
  std::error_code unreadable;
  if (file_.empty() || !fs::exists(file_, unreadable)) return false;
  const Lock lock(file_);
  std::vector<Named> all = read();
  if (std::erase_if(all, [&](const Named& snapshot) { return snapshot.first == name; }) == 0) return false;
  write(all);
  return true;
}

}  // namespace layfigure::session
