#pragma once

#include <assimp/IOSystem.hpp>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "companion.h"

namespace layfigure::character {

/// The files that assimp sees while it reads a character: the character's own and those in its folder and below, with
/// symbolic links followed. Whatever else a file names, by "..", an absolute path or a link, is as if it were not
/// there. A file is read once and served from memory, so that all readers see the bytes that the digest is of, mended
/// (source_mend.h).
class FolderIo : public Assimp::IOSystem {
 public:
  explicit FolderIo(const std::filesystem::path& character);

  bool Exists(const char* name) const override;
  [[nodiscard]] char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char* mode) override;
  void Close(Assimp::IOStream* stream) override;

  /// The character's own digest, if it was opened.
  [[nodiscard]] std::optional<cache::Digest> character_digest() const;
  /// All other files that were asked for, by name.
  [[nodiscard]] std::vector<Companion> companions() const;

 private:
  struct File {
    std::string bytes;
    cache::Digest digest;
  };
  /// Where a name leads, if it may be looked at.
  [[nodiscard]] std::optional<std::filesystem::path> resolve(const char* name) const;
  /// Reads a file or finds what was read before; null if it is no regular file that can be read.
  const File* load(const std::filesystem::path& path);

  std::filesystem::path character_;
  std::filesystem::path folder_;
  std::map<std::filesystem::path, File> files_;
  mutable std::map<std::filesystem::path, bool> seen_;  ///< whether the path was a file when it was asked for
};

}  // namespace layfigure::character
