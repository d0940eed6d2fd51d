#include "text.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace layfigure::character {
namespace {

std::string readable(std::string name) {
  make_readable(name);
  return name;
}

TEST(MakeReadable, Utf8_IsKept) {
  for (const char* name : {"", "hip", "Kopf_ä", "左腕", "\xF0\x9F\xA6\xB4 bone"}) {
    std::string text = name;
    EXPECT_FALSE(make_readable(text));
    EXPECT_EQ(text, name);
  }
}

TEST(MakeReadable, Latin1_BecomesUtf8) {
  EXPECT_EQ(readable("H\xFC"
                     "fte"),
            "Hüfte");
  EXPECT_EQ(readable("\xE4\xF6"), "äö");
}

TEST(MakeReadable, BytesThatAreNoUtf8_AreTakenAsLatin1) {
  // Overlong, surrogate, above U+10FFFF, cut short, a lone continuation.
  for (const char* bad : {"\xC0\x80", "\xE0\x80\x80", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xF0\x80\x80\x80",
                          "\xE5\xB7", "\xF0\x9F\xA6", "\x80", "\xFF"}) {
    std::string text = bad;
    EXPECT_TRUE(make_readable(text)) << bad;
    EXPECT_FALSE(make_readable(text)) << "not valid after all: " << bad;
  }
}

TEST(MakeReadable, ControlCharacters_BecomeUnderscores) { EXPECT_EQ(readable("left\narm\t\x7F\x1B"), "left_arm___"); }

TEST(OneLine, LongOrManyLines_IsOneLineOfBoundedLength) {
  EXPECT_EQ(one_line("two\nlines\r\n"), "two lines  ");
  const std::string cut = one_line(std::string(kLongestMessage - 1, 'x') + "äöü and so on");
  EXPECT_LE(cut.size(), kLongestMessage + 3);
  std::string same = cut;
  EXPECT_FALSE(make_readable(same)) << "cut inside a character";
}

}  // namespace
}  // namespace layfigure::character
