#include "tools/plot/axis_range.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace mray::plot {
namespace {

/// About as many ticks as an axis has room for.
constexpr double kTicks = 6;
/// A logarithmic axis of fewer decades has ticks at 1, 2 and 5 times powers of ten.
constexpr double kManyDecades = 2.5;
constexpr double kMostDecades = 8;
constexpr double kMostPowersOfTwo = 13;
/// The part of a tight axis that is left free at each end.
constexpr double kTightMargin = 0.02;

struct Extent {
    double least;
    double largest;
};

template <class Accept>
std::optional<Extent> extent_of(std::span<const double> values, Accept accept) {
    std::optional<Extent> extent;
    for (const double value : values) {
        if (!std::isfinite(value) || !accept(value)) continue;
        if (!extent) extent = {value, value};
        extent = {std::min(extent->least, value), std::max(extent->largest, value)};
    }
    return extent;
}

std::string number_text(double value) { return fmt::format("{:.6g}", value); }

/// 1, 2 or 5 times a power of ten, at least `step`.
double nice_step(double step) {
    const double power = std::pow(10, std::floor(std::log10(step)));
    for (const double factor : {1.0, 2.0, 5.0}) {
        if (factor * power >= step * (1 - 1e-9)) return factor * power;
    }
    return 10 * power;
}

AxisRange linear_range(const Axis& axis, Extent extent) {
    AxisRange range;
    double lower = axis.tight ? extent.least : std::min(0.0, extent.least);
    double upper = axis.tight ? extent.largest : std::max(0.0, extent.largest);
    if (!(upper > lower)) upper = lower + 1;
    const double step = nice_step((upper - lower) / kTicks);
    // Ticks within what is shown, counted in steps so that no error adds up.
    if (!axis.tight) {
        lower = std::floor(lower / step + 1e-9) * step;
        upper = std::ceil(upper / step - 1e-9) * step;
    }
    for (auto i = static_cast<std::int64_t>(std::ceil(lower / step - 1e-9));
         static_cast<double>(i) <= upper / step + 1e-9; ++i) {
        const double at = static_cast<double>(i) * step;
        range.ticks.push_back({at, number_text(at)});
    }
    const double margin = axis.tight ? kTightMargin * (upper - lower) : 0;
    range.lower = lower - margin;
    range.upper = upper + margin;
    return range;
}

/// Powers of ten with many digits are written with their exponents.
constexpr int kFirstLongExponent = 5;
constexpr int kLastLongExponent = -4;

std::string decade_text(int exponent, bool is_long) {
    return is_long ? fmt::format("10^{{{}}}", exponent) : number_text(std::pow(10, exponent));
}

AxisRange log10_range(Extent extent) {
    AxisRange range{.log_base = 10};
    std::vector<double> steps;
    const int first = static_cast<int>(std::floor(std::log10(extent.least)));
    const int last = static_cast<int>(std::ceil(std::log10(extent.largest)));
    for (int exponent = first; exponent <= last; ++exponent) {
        for (const double factor : {1.0, 2.0, 5.0})
            steps.push_back(factor * std::pow(10, exponent));
    }
    range.lower = steps.front();
    for (const double step : steps) {
        if (step <= extent.least * (1 + 1e-9)) range.lower = step;
    }
    range.upper = *std::ranges::find_if(steps, [&](double step) {
        return step >= extent.largest * (1 - 1e-9) && step > range.lower;
    });
    const double decades = std::log10(range.upper / range.lower);
    if (decades < kManyDecades) {
        for (const double step : steps) {
            if (step >= range.lower && step <= range.upper)
                range.ticks.push_back({step, number_text(step)});
        }
        return range;
    }
    const int every = static_cast<int>(std::ceil(decades / kMostDecades));
    const bool is_long = extent.largest >= std::pow(10, kFirstLongExponent) ||
                         extent.least <= std::pow(10, kLastLongExponent);
    for (int exponent = first; exponent <= last; ++exponent) {
        const double at = std::pow(10, exponent);
        if (at < range.lower || at > range.upper || exponent % every != 0) continue;
        range.ticks.push_back({at, decade_text(exponent, is_long)});
    }
    return range;
}

AxisRange log2_range(Extent extent) {
    AxisRange range{.log_base = 2};
    const int first = static_cast<int>(std::floor(std::log2(extent.least)));
    const int last =
        std::max(first + 1, static_cast<int>(std::ceil(std::log2(extent.largest) - 1e-9)));
    const int every = static_cast<int>(std::ceil((last - first) / kMostPowersOfTwo));
    for (int exponent = first; exponent <= last; exponent += every)
        range.ticks.push_back({std::ldexp(1, exponent), number_text(std::ldexp(1, exponent))});
    // A quarter of a power beyond the ends, so that symbols stand clear of the frame.
    range.lower = std::exp2(first - 0.25);
    range.upper = std::exp2(last + 0.25);
    return range;
}

AxisRange named_range(const Axis& axis, Direction direction) {
    AxisRange range;
    range.lower = -0.5;
    range.upper = static_cast<double>(axis.names.size()) - 0.5;
    if (direction == Direction::kY) std::swap(range.lower, range.upper);
    for (std::size_t i = 0; i < axis.names.size(); ++i)
        range.ticks.push_back({static_cast<double>(i), axis.names[i]});
    return range;
}

}  // namespace

double AxisRange::place(double value) const {
    return log_base != 0 && value <= 0 ? zero_at : value;
}

double AxisRange::fraction(double value) const {
    const double at = place(value);
    if (log_base == 0) return (at - lower) / (upper - lower);
    return std::log(at / lower) / std::log(upper / lower);
}

AxisRange fit_axis(const Axis& axis, Direction direction, std::span<const double> values) {
    if (!axis.names.empty()) return named_range(axis, direction);
    const auto positive = extent_of(values, [](double value) { return value > 0; });
    const auto all = extent_of(values, [](double) { return true; });
    const bool has_zero = all && all->least <= 0;
    Scale scale = axis.scale;
    if (scale == Scale::kAuto) {
        const bool wide = positive && positive->largest > kLogRatio * positive->least;
        scale = wide && !has_zero ? Scale::kLog10 : Scale::kLinear;
    }
    if (scale == Scale::kLinear) return linear_range(axis, all.value_or(Extent{0, 1}));
    const double least = axis.least_positive;
    Extent extent = positive.value_or(least > 0 ? Extent{least, 10 * least} : Extent{1, 10});
    if (least > 0) extent.least = std::min(extent.least, least);
    AxisRange range = scale == Scale::kLog2 ? log2_range(extent) : log10_range(extent);
    if (has_zero && !axis.zero_name.empty()) {
        // Clear of the least value.
        range.zero_at = std::pow(10, std::floor(std::log10(range.lower / 3)));
        std::erase_if(range.ticks, [&](const Tick& tick) { return tick.at <= range.zero_at; });
        range.ticks.insert(range.ticks.begin(), {range.zero_at, axis.zero_name});
        range.lower = range.zero_at / 2;
    }
    return range;
}

}  // namespace mray::plot
