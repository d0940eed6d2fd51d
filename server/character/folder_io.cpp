#include "folder_io.h"

#include <assimp/MemoryIOWrapper.h>

#include <algorithm>
#include <fstream>

#include "source_mend.h"

namespace layfigure::character {
namespace {

namespace fs = std::filesystem;

fs::path folder_of(const fs::path& file) { return fs::canonical(fs::absolute(file).parent_path()); }

bool is_below(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

}  // namespace

FolderIo::FolderIo(const fs::path& character) : character_(fs::canonical(character)), folder_(folder_of(character)) {}

std::optional<fs::path> FolderIo::resolve(const char* name) const {
  std::error_code error;
  const fs::path path = fs::weakly_canonical(name, error);
  if (error || !(path == character_ || is_below(path, folder_))) return std::nullopt;
  return path;
}

bool FolderIo::Exists(const char* name) const {
  const std::optional<fs::path> path = resolve(name);
  return path && seen_.try_emplace(*path, is_file(*path)).first->second;
}

const FolderIo::File* FolderIo::load(const fs::path& path) {
  if (const auto known = files_.find(path); known != files_.end()) return &known->second;
  if (!seen_.try_emplace(path, is_file(path)).first->second) return nullptr;
  std::ifstream stream(path, std::ios::binary);
  std::string bytes(fs::file_size(path), '\0');
  if (!stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) {
    seen_[path] = false;
    return nullptr;
  }
  const cache::Digest digest = cache::digest_of(bytes);
  bytes = mend_source(std::move(bytes), path.extension().string());
  return &files_.emplace(path, File{std::move(bytes), digest}).first->second;
}

Assimp::IOStream* FolderIo::Open(const char* name, const char* mode) {
  const std::optional<fs::path> path = resolve(name);
  if (!path || mode[0] != 'r') return nullptr;
  const File* file = load(*path);
  if (file == nullptr) return nullptr;
  return new Assimp::MemoryIOStream(reinterpret_cast<const uint8_t*>(file->bytes.data()), file->bytes.size());
}

void FolderIo::Close(Assimp::IOStream* stream) { delete stream; }

std::optional<cache::Digest> FolderIo::character_digest() const {
  const auto file = files_.find(character_);
  return file == files_.end() ? std::nullopt : std::optional(file->second.digest);
}

std::vector<Companion> FolderIo::companions() const {
  std::vector<Companion> result;
  for (const auto& [path, exists] : seen_) {
    if (path == character_) continue;
    Companion companion{path.lexically_relative(folder_).string(), Companion::Use::kAbsent, {}};
    if (const auto file = files_.find(path); file != files_.end()) {
      companion.use = Companion::Use::kRead;
      companion.digest = file->second.digest;
    } else if (exists) {
      companion.use = Companion::Use::kSeen;
    }
    result.push_back(std::move(companion));
  }
  return result;
}

}  // namespace layfigure::character
