// Tells a change of measured values from their noise.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace mray {

/// Values of one figure, measured before and after under one condition, such as one frame of a
/// clip.
struct Stratum {
    std::vector<double> before;
    std::vector<double> after;
};

/// The chance that values after would rank as high as they do, or higher, if both sides were drawn
/// from the same distribution: the one-sided test of Mann and Whitney, with ranks taken in each
/// stratum on its own and then added up (van Elteren's test with equal weights). Equal values share
/// their mean rank. Exact for up to kMostExact values in all; beyond, the normal distribution with
/// the mean and the variance of the rank sum. 1 if there are no values.
/// Based on: H. B. Mann, D. R. Whitney. On a Test of Whether one of Two Random Variables is
/// Stochastically Larger than the Other. 1947; P. H. van Elteren. On the Combination of Independent
/// Two Sample Tests of Wilcoxon. 1960.
double chance_of_rise(std::span<const Stratum> strata);

inline constexpr std::size_t kMostExact = 64;

/// The least chance that chance_of_rise() can return for this number of values: that of all values
/// after above all before.
double least_chance(std::span<const Stratum> strata);

/// The least number of values on each side of each of so many strata (at least one) for which
/// least_chance() is below `level`, a number above 0.
std::size_t least_values(std::size_t strata, double level);

/// Holm's correction for several tests at a time: returns, for each chance, one that may be
/// compared with the level that all tests keep together. Based on: S. Holm. A Simple Sequentially
/// Rejective Multiple Test Procedure. 1979.
std::vector<double> corrected_chances(std::span<const double> chances);

struct RatioInterval {
    double ratio = 1;
    double least = 1;
    double most = 1;
};

/// The ratio of medians, after to before, of the stratum whose ratio is the median of all strata
/// (the geometric mean of the two in the middle), and the interval in which it lies with this
/// confidence (0 to 1): quantiles of the ratios of samples that are drawn with replacement from
/// each side of each stratum (the percentile bootstrap). Draws come from a generator with a fixed
/// seed, so that equal values give equal intervals. Requires at least one stratum, and at least one
/// value above 0 on each side of each. Based on: B. Efron. Bootstrap Methods: Another Look at the
/// Jackknife. 1979.
RatioInterval ratio_of_medians(std::span<const Stratum> strata, double confidence);

}  // namespace mray
