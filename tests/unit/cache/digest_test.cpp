#include "layfigure/cache/digest.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace layfigure::cache {
namespace {

TEST(Digest, EmptyInput_IsThatOfTheAlgorithm) {
  EXPECT_EQ(digest_of("").hex(), "99aa06d3014798d86001c324468d497f");  // XXH3, 128 bits, of nothing
}

TEST(Digest, OneBitChanged_IsAnother) {
  const std::string bytes(1000, 'x');
  for (std::size_t k = 0; k < bytes.size(); k += 37) {
    std::string changed = bytes;
    changed[k] = static_cast<char>(changed[k] ^ 1);
    EXPECT_NE(digest_of(changed), digest_of(bytes)) << k;
  }
}

TEST(Digest, Parts_GiveTheDigestOfTheWhole) {
  EXPECT_EQ(Digester().add("one ").add("two").value(), digest_of("one two"));
}

TEST(Digest, File_HasThatOfItsBytes) {
  const auto path = std::filesystem::temp_directory_path() / ("layfigure-digest-" + std::to_string(::getpid()));
  const std::string bytes(3'000'000, 'y');  // more than is read at once
  std::ofstream(path, std::ios::binary) << bytes;
  EXPECT_EQ(digest_of_file(path), digest_of(bytes));
  std::filesystem::remove(path);
  EXPECT_EQ(digest_of_file(path), std::nullopt);
}

}  // namespace
}  // namespace layfigure::cache
