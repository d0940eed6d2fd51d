#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace layfigure::cache {

/// What tells one content from another: XXH3 in 128 bits. Quick, even over any change by accident; it does not keep out
/// somebody who wants two contents to have the same.
struct Digest {
  std::uint64_t high{0};
  std::uint64_t low{0};

  [[nodiscard]] auto operator<=>(const Digest&) const = default;
  /// 32 hexadecimal digits.
  [[nodiscard]] std::string hex() const;
};

/// The digest of parts that are added one after the other.
class Digester {
 public:
  Digester();
  ~Digester();
  Digester(const Digester&) = delete;
  Digester& operator=(const Digester&) = delete;

  /// Bytes; their number is not part of the digest.
  Digester& add(std::string_view bytes);
  Digester& add(const Digest& digest);
  [[nodiscard]] Digest value() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

[[nodiscard]] Digest digest_of(std::string_view bytes);

/// Of a file's bytes; nothing if it cannot be read. About 5 GB/s once it is in memory.
[[nodiscard]] std::optional<Digest> digest_of_file(const std::filesystem::path& path);

}  // namespace layfigure::cache
