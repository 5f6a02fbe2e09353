// Medians and spread of measured values.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace mray {

/// The middle value, or the mean of the two in the middle. Requires at least one value.
inline double median(std::vector<double> values) {
    assert(!values.empty());
    std::sort(values.begin(), values.end());
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 != 0 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

/// The value with the middle key; of an even number of values the lower one in the middle, so that
/// the result is a value that was measured. Requires at least one value.
template <class T, class Key = std::identity>
T lower_median(std::vector<T> values, Key key = {}) {
    assert(!values.empty());
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
    std::nth_element(values.begin(), middle, values.end(),
                     [&](const T& a, const T& b) { return key(a) < key(b); });
    return *middle;
}

/// The value below which a part (0 to 1) of the values lies, between two of them interpolated
/// linearly.
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
    /// The distance between the quartiles, in percent of the median: half of the values lie in a
    /// range of this width. 0 for a single value, and if the median is 0.
    double percent = 0;
};

/// Requires at least one value, in any order; values are finite and not negative.
inline Spread spread_of(std::span<const double> values) {
    std::vector<double> ascending(values.begin(), values.end());
    std::ranges::sort(ascending);
    Spread spread{.least = ascending.front(), .median = quantile(ascending, 0.5)};
    if (spread.median > 0) {
        spread.percent =
            100 * (quantile(ascending, 0.75) - quantile(ascending, 0.25)) / spread.median;
    }
    return spread;
}

}  // namespace mray
