#include "common/text/base64.h"

#include <gtest/gtest.h>

#include <optional>
#include <string_view>

namespace mray {
namespace {

std::string of(std::string_view text) { return base64(std::as_bytes(std::span(text))); }

// The examples of RFC 4648, section 10.
TEST(Base64, IsThatOfTheStandard) {
    EXPECT_EQ(of(""), "");
    EXPECT_EQ(of("f"), "Zg==");
    EXPECT_EQ(of("fo"), "Zm8=");
    EXPECT_EQ(of("foo"), "Zm9v");
    EXPECT_EQ(of("foob"), "Zm9vYg==");
    EXPECT_EQ(of("fooba"), "Zm9vYmE=");
    EXPECT_EQ(of("foobar"), "Zm9vYmFy");
    EXPECT_EQ(of("\xFF\xEF\xBE"), "/+++");
}

TEST(Base64, ReadsWhatItWrites) {
    for (const std::string_view text : {"", "f", "fo", "foo", "foob", "fooba", "\xFF\xEF\xBE"})
        EXPECT_EQ(from_base64(of(text)), text);
    EXPECT_EQ(from_base64(of(std::string_view("\0\0a", 3))), std::string_view("\0\0a", 3));
}

TEST(Base64, RefusesOtherText) {
    for (const char* const text :
         {"Z", "Zg", "Zg=", "Zg==Zg==", "Z===", "====", "Zm9v\n", "Zm 9", "Zm9*", "Zg=a"})
        EXPECT_EQ(from_base64(text), std::nullopt) << text;
}

}  // namespace
}  // namespace mray
