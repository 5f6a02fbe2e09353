// The range of an axis and its ticks, from the values to be shown.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tools/plot/figure.h"

namespace mray::plot {

struct Tick {
    double at = 0;
    /// The label; on an axis of powers of ten that reaches 10^5 or 10^-4 it is "10^{N}".
    std::string text;
};

struct AxisRange {
    /// 0 for a linear axis, else the base of its logarithm.
    int log_base = 0;
    /// The values at the left or lower end and at the other end; axes of names downwards have
    /// lower > upper.
    double lower = 0;
    double upper = 1;
    std::vector<Tick> ticks = {};
    /// Where values of 0 stand on a logarithmic axis; 0: there are none.
    double zero_at = 0;

    /// The value, or zero_at.
    double place(double value) const;
    /// Where a value stands, from 0 at the lower end to 1 at the upper one.
    double fraction(double value) const;
};

/// Whether an axis of names goes downwards.
enum class Direction { kX, kY };

/// The range that shows all finite values. Without any it is [0, 1].
AxisRange fit_axis(const Axis& axis, Direction direction, std::span<const double> values);

}  // namespace mray::plot
