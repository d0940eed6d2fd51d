#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "layfigure/doll/doll.h"
#include "layfigure/haptics/doll_memory.h"

namespace layfigure::session {

/// A file of snapshots that cannot be used. what() is one line with the file and the mend.
class SnapshotError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The named states of one character. All may throw SnapshotError.
class Snapshots {
 public:
  static constexpr std::size_t kMost = 256;
  static constexpr std::size_t kMostLetters = 64;  ///< bytes of a name

  virtual ~Snapshots() = default;
  /// In the order in which they were first saved.
  [[nodiscard]] virtual std::vector<std::string> names() = 0;
  [[nodiscard]] virtual std::optional<haptics::DollMemory> find(const std::string& name) = 0;
  /// Replaces one of that name.
  virtual void save(const std::string& name, const haptics::DollMemory& memory) = 0;
  /// False if there is none of that name.
  [[nodiscard]] virtual bool remove(const std::string& name) = 0;
};

/// Snapshots in a file that outlives the server. Each call reads the file; what changes it writes a new one beside it
/// and renames that, under a lock, so that servers of the same character share it and a crash or a full disk leaves the
/// old one. It is not waited for the disk, which takes longer than a step may: a power cut can lose the last one.
/// Throws SnapshotError: the file cannot be read or written, is damaged, or is of a doll with other bodies.
class SnapshotFile : public Snapshots {
 public:
  /// In `file`, which save() makes; empty: there is no place for one. `doll` must outlive this.
  SnapshotFile(const doll::Doll& doll, std::filesystem::path file) : doll_(&doll), file_(std::move(file)) {}
  /// In layfigure/ below $XDG_STATE_HOME, else below $HOME/.local/state, by the character's hash.
  [[nodiscard]] static std::filesystem::path of_user(const doll::Doll& doll);

  [[nodiscard]] std::vector<std::string> names() override;
  [[nodiscard]] std::optional<haptics::DollMemory> find(const std::string& name) override;
  void save(const std::string& name, const haptics::DollMemory& memory) override;
  [[nodiscard]] bool remove(const std::string& name) override;

 private:
  using Named = std::pair<std::string, haptics::DollMemory>;
  [[nodiscard]] std::vector<Named> read() const;
  void write(const std::vector<Named>& snapshots) const;

  const doll::Doll* doll_;
  std::filesystem::path file_;
};

}  // namespace layfigure::session
