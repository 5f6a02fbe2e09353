// Medians and spread of measured values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace mray {

/// The value below which a part (0 to 1) of the values lies, interpolated linearly.
inline double quantile(std::span<const double> ascending, double part) {
    const double place = part * static_cast<double>(ascending.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, ascending.size() - 1);
    return ascending[below] +
           (place - static_cast<double>(below)) * (ascending[above] - ascending[below]);
}

struct Spread {
    double least = 0;
    double median = 0;
    /// The quartiles, between which half of the values lie.
    double lower = 0;
    double upper = 0;
    /// upper - lower in percent of the median; 0 if that is 0.
    double percent = 0;
};

/// Requires at least one value, in any order; values are finite and not negative.
inline Spread spread_of(std::span<const double> values) {
    std::vector<double> ascending(values.begin(), values.end());
    std::ranges::sort(ascending);
    Spread spread{.least = ascending.front(),
                  .median = quantile(ascending, 0.5),
                  .lower = quantile(ascending, 0.25),
                  .upper = quantile(ascending, 0.75)};
    if (spread.median > 0) spread.percent = 100 * (spread.upper - spread.lower) / spread.median;
    return spread;
}

/// The middle value, or the mean of the two in the middle. Requires at least one value.
inline double median(std::span<const double> values) { return spread_of(values).median; }

}  // namespace mray
