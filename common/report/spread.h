// Least, median and spread of measured values.
#pragma once

#include <span>

namespace mray {

struct Spread {
    double least = 0;
    double median = 0;
    /// The distance between the quartiles, in percent of the median: half of the values lie in a
    /// range of this width. 0 for a single value, and if the median is 0.
    double percent = 0;
};

/// The value below which a part (0 to 1) of the values lies, between two of them interpolated
/// linearly. Requires at least one value, in ascending order.
double quantile(std::span<const double> ascending, double part);

/// Requires at least one value, in any order; values are finite and not negative.
Spread spread_of(std::span<const double> values);

}  // namespace mray
