#include "common/update/policy/slowdown_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mray {
namespace {

// The guess weighs as much as one tree that was replaced at a ratio of 2.
constexpr double kFirstWeight = 0.48;
// What an observation still weighs when the next one comes.
constexpr double kMemory = 0.8;
// A time that was disturbed must not teach that a tree gets faster as it rots, or slower than its
// own cost says.
constexpr double kMostExponent = 1.25;
// How far the watched frames may outweigh the guess: it has to stay above 0, or a tree whose
// degradation is hidden by an image that becomes easier would never be tried.
constexpr double kMostWatched = 2 * kFirstWeight;

}  // namespace

double SlowdownModel::slowdown(double cost_ratio) const {
    if (cost_ratio <= 1) return 1;
    if (std::isinf(cost_ratio)) return std::numeric_limits<double>::infinity();
    return std::pow(cost_ratio, exponent());
}

double SlowdownModel::exponent() const {
    return (kFirstWeight * first_exponent_ + watched_weight_ * watched_exponent_ +
            weighted_exponent_) /
           (kFirstWeight + watched_weight_ + weight_);
}

void SlowdownModel::watch(double cost_ratio, double trace) {
    if (!(trace > 0) || !(cost_ratio > 0) || std::isinf(cost_ratio)) return;
    if (first_trace_ <= 0) {
        first_trace_ = trace;
        first_ratio_ = cost_ratio;
        return;
    }
    const double x = std::log(cost_ratio / first_ratio_);
    if (x * x < watched_weight_ || !(x > 0)) return;
    const double y = std::clamp(std::log(trace / first_trace_), 0.0, kMostExponent * x);
    watched_weight_ = std::min(x * x, kMostWatched);
    watched_exponent_ = y / x;
}

void SlowdownModel::learn(double ratio_before, double trace_before, double ratio_after,
                          double trace_after) {
    if (!(trace_before > 0) || !(trace_after > 0) || !(ratio_after > 0)) return;
    const double x = std::log(ratio_before) - std::log(ratio_after);
    if (!(x > 0) || std::isinf(x)) return;
    const double y = std::clamp(std::log(trace_before / trace_after), 0.0, kMostExponent * x);
    weight_ = kMemory * weight_ + x * x;
    weighted_exponent_ = kMemory * weighted_exponent_ + x * y;
}

}  // namespace mray
