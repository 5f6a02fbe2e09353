#include "common/text/text_parts.h"

#include <gtest/gtest.h>

namespace mray {
namespace {

TEST(Split, GivesOnePartMoreThanSeparators) {
    using Parts = std::vector<std::string_view>;
    EXPECT_EQ(split("a,b", ','), (Parts{"a", "b"}));
    EXPECT_EQ(split("", ','), (Parts{""}));
    EXPECT_EQ(split(",a,", ','), (Parts{"", "a", ""}));
}

TEST(Trimmed, TakesBlanksFromTheEndsOnly) {
    EXPECT_EQ(trimmed("  a b ", " "), "a b");
    EXPECT_EQ(trimmed("\ta\f", " \t\f"), "a");
    EXPECT_EQ(trimmed("   ", " "), "");
    EXPECT_EQ(trimmed("", " "), "");
}

}  // namespace
}  // namespace mray
