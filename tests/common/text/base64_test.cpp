#include "common/text/text.h"

#include <gtest/gtest.h>

#include <optional>
#include <string_view>

namespace mray {
namespace {

TEST(Base64, ReadsTheExamplesOfTheStandard) {
    // RFC 4648, section 10.
    const struct {
        const char* text;
        std::string_view bytes;
    } cases[] = {{"", ""},
                 {"Zg==", "f"},
                 {"Zm8=", "fo"},
                 {"Zm9v", "foo"},
                 {"Zm9vYg==", "foob"},
                 {"Zm9vYmE=", "fooba"},
                 {"Zm9vYmFy", "foobar"},
                 {"/+++", "\xFF\xEF\xBE"},
                 {"AABh", {"\0\0a", 3}}};
    for (const auto& [text, bytes] : cases) EXPECT_EQ(from_base64(text), bytes) << text;
}

TEST(Base64, RefusesOtherText) {
    for (const char* const text :
         {"Z", "Zg", "Zg=", "Zg==Zg==", "Z===", "====", "Zm9v\n", "Zm 9", "Zm9*", "Zg=a"})
        EXPECT_EQ(from_base64(text), std::nullopt) << text;
}

}  // namespace
}  // namespace mray
