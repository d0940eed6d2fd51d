#include "companion.h"

namespace layfigure::character {

bool is_unchanged(const Companion& companion, const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / companion.path;
  std::error_code error;
  const bool exists = std::filesystem::is_regular_file(path, error);
  switch (companion.use) {
    case Companion::Use::kAbsent:
      return !exists;
    case Companion::Use::kSeen:
      return exists;
    case Companion::Use::kRead:
      return exists && cache::digest_of_file(path) == companion.digest;
  }
  return false;
}

}  // namespace layfigure::character
