#include "common/text/text_parts.h"

#include <gtest/gtest.h>

#include <string>

namespace mray {
namespace {

TEST(Utf8, LengthsAreThoseOfTheFirstCharacter) {
    EXPECT_EQ(utf8_length(""), 0u);
    EXPECT_EQ(utf8_length("ab"), 1u);
    EXPECT_EQ(utf8_length(std::string_view("\0", 1)), 1u);
    EXPECT_EQ(utf8_length("\xc2\x80"), 2u);
    EXPECT_EQ(utf8_length("\xdf\xbf"), 2u);
    EXPECT_EQ(utf8_length("\xe0\xa0\x80"), 3u);
    EXPECT_EQ(utf8_length("\xed\x9f\xbf"), 3u);
    EXPECT_EQ(utf8_length("\xf0\x90\x80\x80"), 4u);
    EXPECT_EQ(utf8_length("\xf4\x8f\xbf\xbf"), 4u);
}

TEST(Utf8, RefusesWhatTheStandardRefuses) {
    for (const char* text :
         {"\x80", "\xbf", "\xc0\x80", "\xc1\xbf", "\xc2", "\xc2x", "\xe0\x9f\xbf", "\xe2\x82",
          "\xed\xa0\x80", "\xf0\x8f\xbf\xbf", "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xff"})
        EXPECT_EQ(utf8_length(text), 0u) << utf8_text(text);
}

TEST(Utf8, TextHasOtherBytesInHexadecimalDigits) {
    EXPECT_EQ(utf8_text("caf\xe9 caf\xc3\xa9"), "caf\\xE9 caf\xc3\xa9");
    EXPECT_EQ(utf8_text("\xe2\x82"), "\\xE2\\x82");
    EXPECT_EQ(utf8_text("\n\t"), "\n\t");
}

}  // namespace
}  // namespace mray
