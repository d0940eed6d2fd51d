#include "texture_path.h"

#include <gtest/gtest.h>

namespace layfigure::character {
namespace {

std::string path_of(const std::string& path) { return texture_path(path, "/home/me/doll", false); }

TEST(TexturePath, RelativePaths_AreKeptWithSlashes) {
  EXPECT_EQ(path_of("skin.png"), "skin.png");
  EXPECT_EQ(path_of("./textures/skin.png"), "textures/skin.png");
  EXPECT_EQ(path_of("textures\\skin.png"), "textures/skin.png");
  EXPECT_EQ(path_of("..\\maps\\skin.png"), "../maps/skin.png");
}

TEST(TexturePath, AbsolutePaths_AreRelativeBelowTheFolderAlone) {
  EXPECT_EQ(path_of("/home/me/doll/maps/skin.png"), "maps/skin.png");
  EXPECT_EQ(path_of("file:///home/me/doll/skin.png"), "skin.png");
  EXPECT_EQ(path_of("/home/me/skin.png"), "/home/me/skin.png");
  EXPECT_EQ(path_of("/home/me/dollhouse/skin.png"), "/home/me/dollhouse/skin.png");
  EXPECT_EQ(path_of("C:\\maps\\skin.png"), "C:/maps/skin.png");
}

TEST(TexturePath, OfAUri_IsDecoded) {
  EXPECT_EQ(texture_path("my%20skin%2Fa.png", "/d", true), "my skin/a.png");
  EXPECT_EQ(texture_path("100%.png", "/d", true), "100%.png");
  EXPECT_EQ(texture_path("50%zz.png", "/d", true), "50%zz.png");
  EXPECT_EQ(path_of("my%20skin.png"), "my%20skin.png");
  EXPECT_EQ(path_of("https://example.org/a//b.png"), "https://example.org/a//b.png");
}

TEST(TexturePath, BrokenText_IsMadeReadable) {
  EXPECT_EQ(path_of("a\nb.png"), "a_b.png");
  EXPECT_EQ(path_of("h\xE4ut.png"), "h\u00e4ut.png");
  EXPECT_EQ(base_name("C:\\maps\\skin\t.png"), "skin_.png");
  EXPECT_EQ(path_of(""), "");
}

}  // namespace
}  // namespace layfigure::character
