// Chances and intervals of made values, against counts by hand and all arrangements.
#include "tools/measure/change.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace mray {
namespace {

/// The same chance from all ways to choose which values of one stratum are those after.
double counted_chance(const Stratum& stratum) {
    std::vector<double> values = stratum.before;
    values.insert(values.end(), stratum.after.begin(), stratum.after.end());
    const auto rank = [&](double value) {
        double below = 0;
        for (const double other : values) below += other < value ? 1 : other == value ? 0.5 : 0;
        return below;
    };
    double measured = 0;
    for (const double value : stratum.after) measured += rank(value);
    std::vector<bool> is_after(values.size(), false);
    std::fill(is_after.end() - static_cast<std::ptrdiff_t>(stratum.after.size()), is_after.end(),
              true);
    double all = 0;
    double high = 0;
    do {
        double sum = 0;
        for (std::size_t i = 0; i < values.size(); ++i) sum += is_after[i] ? rank(values[i]) : 0;
        ++all;
        high += sum >= measured ? 1 : 0;
    } while (std::next_permutation(is_after.begin(), is_after.end()));
    return high / all;
}

TEST(ChanceOfRise, IsThatOfAllArrangements) {
    for (const Stratum& stratum : {Stratum{{1, 2, 3}, {4, 5, 6}},
                                   {{4, 5, 6}, {1, 2, 3}},
                                   {{1, 3, 5}, {2, 4, 6}},
                                   {{1, 1, 2}, {1, 2, 2}},
                                   {{5, 5, 5}, {5, 5}},
                                   {{1}, {2, 3, 3, 9}},
                                   {{2, 7, 1, 8, 2, 8}, {3, 1, 4, 1, 5, 9}}})
        EXPECT_NEAR(chance_of_rise(std::vector{stratum}), counted_chance(stratum), 1e-14);
}

TEST(ChanceOfRise, IsOneInTheNumberOfArrangementsAtBest) {
    const std::vector<Stratum> strata = {{{1, 2, 3}, {4, 5, 6}}, {{10, 20}, {30, 40}}};
    EXPECT_NEAR(chance_of_rise({strata.data(), 1}), 1.0 / 20, 1e-15);
    EXPECT_NEAR(chance_of_rise(strata), 1.0 / 120, 1e-15);
    EXPECT_NEAR(least_chance(strata), 1.0 / 120, 1e-14);
    EXPECT_EQ(chance_of_rise({}), 1);
    EXPECT_EQ(least_chance({}), 1);
}

TEST(ChanceOfRise, CanBeBelowALevelFromTheLeastNumberOfValuesOn) {
    // 1 in 924 arrangements of 6 and 6 values, 1 in 252 of 5 and 5; and so in two strata.
    EXPECT_EQ(least_values(1, 1.1 / 924), 6u);
    EXPECT_EQ(least_values(1, 0.9 / 252), 6u);
    EXPECT_EQ(least_values(1, 1.1 / 252), 5u);
    EXPECT_EQ(least_values(2, 1.1 / (252 * 252)), 5u);
    EXPECT_EQ(least_values(2, 0.9 / (252 * 252)), 6u);
    EXPECT_EQ(least_values(1, 1), 1u);
}

TEST(ChanceOfRise, RanksEachStratumOnItsOwn) {
    // Each value after is above those before of its own stratum only.
    const std::vector<Stratum> strata = {{{1}, {2}}, {{100}, {200}}, {{10}, {20}}};
    EXPECT_NEAR(chance_of_rise(strata), 1.0 / 8, 1e-15);
    // Half of the 8 arrangements have at least 2 of 3 values after on top.
    const std::vector<Stratum> mixed = {{{1}, {2}}, {{200}, {100}}, {{10}, {20}}};
    EXPECT_NEAR(chance_of_rise(mixed), 0.5, 1e-15);
}

TEST(ChanceOfRise, OfManyValuesIsThatOfTheNormalDistribution) {
    Stratum stratum;
    for (std::size_t i = 0; i < kMostExact; ++i) {
        stratum.before.push_back(static_cast<double>(2 * i));
        stratum.after.push_back(static_cast<double>(2 * i + 1));
    }
    // n values on each side: each value after is above i + 1 values before, so U = n (n + 1) / 2,
    // with the mean n^2 / 2 and the variance n^2 (2n + 1) / 12.
    const auto n = static_cast<double>(kMostExact);
    const double z = (n / 2 - 0.5) / std::sqrt(n * n * (2 * n + 1) / 12);
    EXPECT_NEAR(chance_of_rise(std::vector{stratum}), 0.5 * std::erfc(z / std::sqrt(2.0)), 1e-12);
    Stratum equal{std::vector<double>(100, 3.0), std::vector<double>(100, 3.0)};
    EXPECT_EQ(chance_of_rise(std::vector{equal}), 1);
}

TEST(ChanceOfRise, ExactChancesAreCloseToTheNormalOnes) {
    Stratum stratum;
    for (std::size_t i = 0; i < kMostExact / 2; ++i) {
        stratum.before.push_back(static_cast<double>(2 * i));
        stratum.after.push_back(static_cast<double>(2 * i + 5));
    }
    // Each value after is above 3 more values before than there are before its neighbour, but for
    // the last two: U = n (n + 1) / 2 + 2 n - 3.
    const auto n = static_cast<double>(kMostExact / 2);
    const double z = (n / 2 + 2 * n - 3 - 0.5) / std::sqrt(n * n * (2 * n + 1) / 12);
    EXPECT_NEAR(chance_of_rise(std::vector{stratum}), 0.5 * std::erfc(z / std::sqrt(2.0)), 2e-3);
}

TEST(CorrectedChances, AreHolms) {
    const std::vector<double> chances = {0.01, 0.04, 0.03, 0.005};
    const std::vector<double> expected = {0.03, 0.06, 0.06, 0.02};
    const std::vector<double> corrected = corrected_chances(chances);
    ASSERT_EQ(corrected.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(corrected[i], expected[i], 1e-15);
    EXPECT_EQ(corrected_chances(std::vector<double>{0.7, 0.9}), (std::vector<double>{1, 1}));
    EXPECT_TRUE(corrected_chances({}).empty());
}

TEST(RatioOfMedians, OfValuesWithoutNoiseIsExact) {
    const std::vector<Stratum> strata = {{{2, 2, 2}, {3, 3, 3}}};
    const RatioInterval interval = ratio_of_medians(strata, 0.95);
    EXPECT_NEAR(interval.ratio, 1.5, 1e-15);
    EXPECT_NEAR(interval.least, 1.5, 1e-15);
    EXPECT_NEAR(interval.most, 1.5, 1e-15);
}

TEST(RatioOfMedians, IsThatOfTheStratumInTheMiddle) {
    const std::vector<Stratum> strata = {{{1}, {1000}}, {{1}, {2}}, {{10}, {11}}};
    EXPECT_NEAR(ratio_of_medians(strata, 0.95).ratio, 2, 1e-12);
    // The ratio of two is their geometric mean.
    EXPECT_NEAR(ratio_of_medians({strata.data() + 1, 2}, 0.95).ratio, std::sqrt(2.2), 1e-12);
}

TEST(RatioOfMedians, DrawsAllCombinationsOfTwoValuesAsOftenAsTheyComeAbout) {
    // Medians of two draws of {1, 4}: 1, 2.5 twice, 4. Each ratio to 1 has a chance of 1/4, 1/2,
    // 1/4, so quantiles up to 1/4 are 1 and those from 3/4 on are 4, but for the noise of draws.
    const std::vector<Stratum> strata = {{{1}, {1, 4}}};
    const RatioInterval wide = ratio_of_medians(strata, 0.55);
    EXPECT_NEAR(wide.least, 1, 1e-12);
    EXPECT_NEAR(wide.most, 4, 1e-12);
    EXPECT_NEAR(wide.ratio, 2.5, 1e-12);
    const RatioInterval narrow = ratio_of_medians(strata, 0.45);
    EXPECT_NEAR(narrow.least, 2.5, 1e-12);
    EXPECT_NEAR(narrow.most, 2.5, 1e-12);
}

TEST(RatioOfMedians, IsTheSameForTheSameValues) {
    std::vector<Stratum> strata(3);
    for (int i = 0; i < 60; ++i)
        (i % 2 == 0 ? strata[i % 3].before : strata[i % 3].after).push_back(10 + (i * 31) % 17);
    const RatioInterval first = ratio_of_medians(strata, 0.99);
    const RatioInterval second = ratio_of_medians(strata, 0.99);
    EXPECT_EQ(first.ratio, second.ratio);
    EXPECT_EQ(first.least, second.least);
    EXPECT_EQ(first.most, second.most);
    EXPECT_LT(first.least, first.ratio);
    EXPECT_GT(first.most, first.ratio);
}

}  // namespace
}  // namespace mray
