#include "common/report/spread.h"

#include <cstddef>

namespace mray {
namespace {

/// The value below which a part (0 to 1) of the values lies, between two of them interpolated
/// linearly.
double quantile(std::span<const double> ascending, double part) {
    const double place = part * static_cast<double>(ascending.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, ascending.size() - 1);
    return ascending[below] +
           (place - static_cast<double>(below)) * (ascending[above] - ascending[below]);
}

}  // namespace

Spread spread_of(std::span<const double> values) {
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
