#include "common/text/text.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace mray {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(ParseFloat, ReadsEveryDecimalNumberAsTheNearestFloat) {
    const std::pair<const char*, float> cases[] = {
        {"+.5", 0.5f},
        {"-.0e0", -0.0f},
        {"1.E+0", 1.0f},
        {"0.", 0.0f},
        {"1.000000000000000000000000000000000000001", 1.0f},
        {"-12e-1", -1.2f},
        {"16777217", 16777216.0f},
        {"16777217.0000000000000000000000000001", 16777218.0f},
        {"3.40282346638528859811704183484516925e38", std::numeric_limits<float>::max()},
        {"1e-42", 714 * 0x1p-149f},
        {"-1.4e-45", -0x1p-149f},
        {"7.1e-46", 0x1p-149f},
        {"7e-46", 0.0f},
        {"1e-99999999999999999999", 0.0f},
        {"0.00000000000000000000000000000000000000000000000000000001", 0.0f},
        {"0e999999999999", 0.0f},
        {"1e400", kInfinity},
        {"-1e99999999999999999999", -kInfinity},
        {"100000000000000000000000000000000000000000", kInfinity},
        {"inf", kInfinity},
        {"-Infinity", -kInfinity}};
    for (const auto& [text, value] : cases) {
        ASSERT_TRUE(parse_float(text)) << text;
        EXPECT_EQ(std::bit_cast<unsigned>(*parse_float(text)), std::bit_cast<unsigned>(value))
            << text;
    }
    EXPECT_TRUE(std::isnan(*parse_float("nan")));
    EXPECT_TRUE(std::isnan(*parse_float("-nan(ind)")));
}

TEST(ParseNumber, RefusesOtherText) {
    for (const char* text : {"", "+", "-", ".", "+-1", "++1", "1e", "1e+", "1,5", "0x1p0", "0x10",
                             "1.0f", "1.2.3", "a", " 1", "1 ", "1.#INF", "e5"}) {
        EXPECT_FALSE(parse_float(text)) << text;
        EXPECT_FALSE(parse_double(text)) << text;
        EXPECT_FALSE(parse_unsigned(text)) << text;
        EXPECT_FALSE(parse_integer(text)) << text;
    }
    for (const char* text : {"-1", "+1", "1.0"}) EXPECT_FALSE(parse_unsigned(text)) << text;
    for (const char* text : {"--1", "+1", "1.0"}) EXPECT_FALSE(parse_integer(text)) << text;
}

TEST(ParseDouble, OverflowsAndUnderflowsByItsDigitsAlone) {
    const std::string zeros(400, '0');
    EXPECT_EQ(parse_double("1" + zeros), double{kInfinity});
    EXPECT_EQ(parse_double("-1" + zeros + ".5"), -double{kInfinity});
    EXPECT_EQ(parse_double("0." + zeros + "1"), 0.0);
    EXPECT_EQ(parse_double("0." + zeros + "1e900"), double{kInfinity});
    EXPECT_EQ(parse_double("-1e300"), -1e300);
    EXPECT_EQ(parse_double("1e-400"), 0.0);
}

TEST(ParseInteger, SaturatesInsteadOfWrapping) {
    EXPECT_EQ(parse_unsigned("0"), 0u);
    EXPECT_EQ(parse_unsigned("18446744073709551614"), 18446744073709551614u);
    EXPECT_EQ(parse_unsigned("99999999999999999999999"), 18446744073709551615u);
    EXPECT_EQ(parse_integer("-12"), -12);
    EXPECT_EQ(parse_integer("007"), 7);
    EXPECT_EQ(parse_integer("999999999999999999"), 999'999'999'999'999'999);
    EXPECT_EQ(parse_integer("1000000000000000001"), 1'000'000'000'000'000'000);
    EXPECT_EQ(parse_integer("-18446744073709551615"), -1'000'000'000'000'000'000);
}

TEST(HexText, HasAllBits) {
    EXPECT_EQ(hex_text(0), "0x0p+0");
    EXPECT_EQ(hex_text(-0.0), "-0x0p+0");
    EXPECT_EQ(hex_text(3), "0x1.8p+1");
    EXPECT_EQ(hex_text(-0.1f), "-0x1.99999ap-4");
    EXPECT_EQ(hex_text(std::numeric_limits<float>::denorm_min()), "0x1p-149");
    EXPECT_EQ(hex_text(-kInfinity), "-inf");
}

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
