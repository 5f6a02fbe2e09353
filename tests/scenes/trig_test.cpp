// Sines and cosines of scenes.
#include <gtest/gtest.h>

#include <cmath>

#include "scenes/trig.h"

namespace mray {
namespace {

constexpr long double kTwoPi = 6.283185307179586476925286766559005768L;

TEST(Trig, AgreesWithTheLibraryInLongDouble) {
    for (int i = -20000; i <= 20000; ++i) {
        const double x = i / 4096.0 * 1.000123;
        const long double turn = x - std::floor(x);
        EXPECT_NEAR(sin_turns(x), double(std::sin(kTwoPi * turn)), 0x1p-50) << x;
        EXPECT_NEAR(cos_turns(x), double(std::cos(kTwoPi * turn)), 0x1p-50) << x;
    }
}

TEST(Trig, IsExactAtQuarterTurns) {
    const double sines[] = {0, 1, 0, -1};
    for (int quarter = -40; quarter <= 40; ++quarter) {
        EXPECT_EQ(sin_turns(quarter / 4.0), sines[(quarter + 40) % 4]);
        EXPECT_EQ(cos_turns(quarter / 4.0), sines[(quarter + 41) % 4]);
    }
}

}  // namespace
}  // namespace mray
