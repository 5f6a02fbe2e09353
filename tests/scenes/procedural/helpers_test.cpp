// The helpers of the built-in scenes.
#include <gtest/gtest.h>

#include <cmath>

#include "scenes/procedural/helpers.h"
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

TEST(SmoothStep, RisesFromZeroToOneBetweenItsEnds) {
    EXPECT_EQ(smooth_step(2, 6, 1), 0);
    EXPECT_EQ(smooth_step(2, 6, 2), 0);
    EXPECT_EQ(smooth_step(2, 6, 4), 0.5);
    EXPECT_EQ(smooth_step(2, 6, 6), 1);
    EXPECT_EQ(smooth_step(2, 6, 9), 1);
}

TEST(CubeRoot, IsTheLargestIntegerWhoseCubeIsNotAbove) {
    EXPECT_EQ(cube_root(0), 0u);
    EXPECT_EQ(cube_root(std::uint64_t{1} << 60), 1u << 20);
    for (std::uint64_t n = 1; n <= 700; ++n) {
        EXPECT_EQ(cube_root(n * n * n), n);
        EXPECT_EQ(cube_root(n * n * n - 1), n - 1);
        EXPECT_EQ(cube_root(n * n * n + 3), n);
    }
}

TEST(Uniform, FillsItsRangeEvenly) {
    for (const std::uint64_t draw : {0, 1, 7}) {
        int bins[16] = {};
        double sum = 0;
        for (std::uint64_t i = 0; i < 16000; ++i) {
            const double x = uniform(5, i, draw);
            ASSERT_GE(x, 0);
            ASSERT_LT(x, 1);
            ++bins[static_cast<int>(16 * x)];
            sum += x * uniform(5, i, draw + 1);
        }
        // Six standard deviations of a binomial of mean 1000.
        for (const int bin : bins) EXPECT_NEAR(bin, 1000, 190);
        EXPECT_NEAR(sum / 16000, 0.25, 0.01);
    }
}

TEST(UniformDirection, HasLengthOneAndNoPreference) {
    glm::dvec3 sum(0);
    for (std::uint64_t i = 0; i < 10000; ++i) {
        const glm::dvec3 d = uniform_direction(3, i);
        ASSERT_NEAR(d.x * d.x + d.y * d.y + d.z * d.z, 1, 1e-14);
        sum += d;
    }
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(sum[axis] / 10000, 0, 0.04);
}

}  // namespace
}  // namespace mray
