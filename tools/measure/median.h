// The median of measured values.
#pragma once

#include <algorithm>
#include <cassert>
#include <vector>

namespace mray {

/// The middle value, or the mean of the two in the middle. Requires at least one value.
inline double median(std::vector<double> values) {
    assert(!values.empty());
    std::sort(values.begin(), values.end());
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 != 0 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

}  // namespace mray
