#include "layfigure/cache/digest.h"

#include <xxhash.h>

#include <fstream>
#include <vector>

namespace layfigure::cache {
namespace {

constexpr std::size_t kBlock = 1U << 20U;  // read at once [bytes]

}  // namespace

struct Digester::State {
  XXH3_state_t hash;
};

std::string Digest::hex() const {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint64_t half : {high, low}) {
    for (int shift = 60; shift >= 0; shift -= 4) text += kDigits[half >> shift & 0xFU];
  }
  return text;
}

Digester::Digester() : state_(std::make_unique<State>()) { XXH3_128bits_reset(&state_->hash); }

Digester::~Digester() = default;

Digester& Digester::add(std::string_view bytes) {
  XXH3_128bits_update(&state_->hash, bytes.data(), bytes.size());
  return *this;
}

Digester& Digester::add(const Digest& digest) { return add(digest.hex()); }

Digest Digester::value() const {
  const XXH128_hash_t hash = XXH3_128bits_digest(&state_->hash);
  return {hash.high64, hash.low64};
}

Digest digest_of(std::string_view bytes) { return Digester().add(bytes).value(); }

std::optional<Digest> digest_of_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  Digester digester;
  std::vector<char> block(kBlock);
  while (file.read(block.data(), kBlock), file.gcount() > 0) {
    digester.add({block.data(), static_cast<std::size_t>(file.gcount())});
  }
  if (file.bad()) return std::nullopt;
  return digester.value();
}

}  // namespace layfigure::cache
