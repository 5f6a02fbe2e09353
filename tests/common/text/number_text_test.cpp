#include "common/text/text.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <string>

namespace mray {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(ParseFloat, ReadsAllDecimalForms) {
    EXPECT_EQ(parse_float("+.5"), 0.5f);
    EXPECT_EQ(parse_float("-.0e0"), 0.0f);
    EXPECT_EQ(parse_float("1.E+0"), 1.0f);
    EXPECT_EQ(parse_float("0."), 0.0f);
    EXPECT_EQ(parse_float("1.000000000000000000000000000000000000001"), 1.0f);
    EXPECT_EQ(parse_float("-12e-1"), -1.2f);
}

TEST(ParseFloat, RoundsToTheNearestFloat) {
    EXPECT_EQ(parse_float("0.1"), 0.1f);
    EXPECT_EQ(parse_float("16777217"), 16777216.0f);
    EXPECT_EQ(parse_float("16777217.0000000000000000000000000001"), 16777218.0f);
    EXPECT_EQ(parse_float("3.40282346638528859811704183484516925e38"),
              std::numeric_limits<float>::max());
}

TEST(ParseFloat, KeepsDenormalsAndUnderflowsToZero) {
    EXPECT_EQ(std::bit_cast<unsigned>(*parse_float("1e-42")), 714u);
    EXPECT_EQ(std::bit_cast<unsigned>(*parse_float("-1.4e-45")), 0x80000001u);
    EXPECT_EQ(std::bit_cast<unsigned>(*parse_float("7.1e-46")), 1u);
    EXPECT_EQ(parse_float("7e-46"), 0.0f);
    EXPECT_EQ(parse_float("1e-999"), 0.0f);
    EXPECT_EQ(parse_float("1e-99999999999999999999"), 0.0f);
    EXPECT_EQ(parse_float("0.00000000000000000000000000000000000000000000000000000001"), 0.0f);
    EXPECT_EQ(parse_float("0e999999999999"), 0.0f);
}

TEST(ParseFloat, OverflowsToInfinity) {
    EXPECT_EQ(parse_float("1e400"), kInfinity);
    EXPECT_EQ(parse_float("-1e99999999999999999999"), -kInfinity);
    EXPECT_EQ(parse_float("3.5e38"), kInfinity);
    EXPECT_EQ(parse_float("100000000000000000000000000000000000000000"), kInfinity);
    EXPECT_EQ(parse_float("inf"), kInfinity);
    EXPECT_EQ(parse_float("-Infinity"), -kInfinity);
    EXPECT_TRUE(std::isnan(*parse_float("nan")));
    EXPECT_TRUE(std::isnan(*parse_float("-nan(ind)")));
}

TEST(ParseFloat, RefusesTextThatIsNoDecimalNumber) {
    for (const char* text : {"", "+", "-", ".", "+-1", "++1", "1e", "1e+", "1,5", "0x1p0", "0x10",
                             "1.0f", "1.2.3", "a", " 1", "1 ", "1.#INF", "e5"}) {
        EXPECT_FALSE(parse_float(text)) << text;
    }
}

TEST(ParseFiniteDouble, RefusesNumbersThatAreNotFinite) {
    EXPECT_EQ(parse_finite_double("0.25"), 0.25);
    EXPECT_EQ(parse_finite_double("-1e300"), -1e300);
    EXPECT_EQ(parse_finite_double("1e-400"), 0.0);
    for (const char* text : {"nan", "inf", "-inf", "1e400", "", "1x"}) {
        EXPECT_FALSE(parse_finite_double(text)) << text;
    }
}

TEST(ParseDouble, OverflowsAndUnderflowsByItsDigitsAlone) {
    const std::string zeros(400, '0');
    EXPECT_EQ(parse_double("1" + zeros), double{kInfinity});
    EXPECT_EQ(parse_double("-1" + zeros + ".5"), -double{kInfinity});
    EXPECT_EQ(parse_double("0." + zeros + "1"), 0.0);
    EXPECT_EQ(parse_double("0." + zeros + "1e900"), double{kInfinity});
}

TEST(ParseUnsigned, TakesDigitsAlone) {
    EXPECT_EQ(parse_unsigned("0"), 0u);
    EXPECT_EQ(parse_unsigned("18446744073709551614"), 18446744073709551614u);
    EXPECT_EQ(parse_unsigned("99999999999999999999999"), 18446744073709551615u);
    for (const char* text : {"", "-1", "+1", "1.0", "0x1", " 1", "1 "}) {
        EXPECT_FALSE(parse_unsigned(text)) << text;
    }
}

TEST(ParseInteger, SaturatesInsteadOfWrapping) {
    EXPECT_EQ(parse_integer("-12"), -12);
    EXPECT_EQ(parse_integer("007"), 7);
    EXPECT_EQ(parse_integer("4294967299"), 4294967299);
    EXPECT_EQ(parse_integer("999999999999999999"), 999'999'999'999'999'999);
    EXPECT_EQ(parse_integer("1000000000000000001"), 1'000'000'000'000'000'000);
    EXPECT_EQ(parse_integer("99999999999999999999"), 1'000'000'000'000'000'000);
    EXPECT_EQ(parse_integer("-18446744073709551615"), -1'000'000'000'000'000'000);
    for (const char* text : {"", "-", "--1", "+1", "1.0", "1a", "a", " 1"}) {
        EXPECT_FALSE(parse_integer(text)) << text;
    }
}

TEST(HexText, HasAllBits) {
    EXPECT_EQ(hex_text(0), "0x0p+0");
    EXPECT_EQ(hex_text(-0.0), "-0x0p+0");
    EXPECT_EQ(hex_text(3), "0x1.8p+1");
    EXPECT_EQ(hex_text(-0.1f), "-0x1.99999ap-4");
    EXPECT_EQ(hex_text(std::numeric_limits<float>::denorm_min()), "0x1p-149");
    EXPECT_EQ(hex_text(-kInfinity), "-inf");
}

}  // namespace
}  // namespace mray
