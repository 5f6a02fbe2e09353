#include "common/update/policy/slowdown_model.h"

#include <algorithm>

namespace mray {
namespace {

// The guess weighs as much as one tree that was replaced at this slow-down beyond 1.
constexpr double kFirstWeight = 0.1;
// The part of its weight that an observation keeps when the next one comes.
constexpr double kMemory = 0.8;
// A time that was disturbed must not teach more than this times the guess, or less than 0.
constexpr double kMostPerVisit = 20;
// How far the watched frames may outweigh the guess: it has to stay above 0, or a tree whose
// degradation is hidden by an image that becomes easier would never be tried.
constexpr double kMostWatched = 2;

}  // namespace

SlowdownModel::SlowdownModel(double first_per_visit)
    : first_per_visit_(first_per_visit),
      first_weight_(kFirstWeight / first_per_visit * (kFirstWeight / first_per_visit)) {}

double SlowdownModel::per_visit() const {
    return (first_weight_ * first_per_visit_ + watched_weight_ * watched_ + weighted_) /
           (first_weight_ + watched_weight_ + weight_);
}

void SlowdownModel::watch(double excess, double trace) {
    if (!(trace > 0)) return;
    if (first_trace_ <= 0) {
        first_trace_ = trace;
        first_excess_ = excess;
        return;
    }
    const double times = trace / first_trace_;
    const double x = excess - first_excess_ * times;
    const double weight = std::min(x * x, kMostWatched * first_weight_);
    if (!(x > 0) || weight < watched_weight_) return;
    watched_weight_ = weight;
    watched_ = std::clamp((times - 1) / x, 0.0, kMostPerVisit * first_per_visit_);
}

// From trace_before / trace_after = (1 + p a) / (1 + p b) follows times - 1 = p (a - times b).
void SlowdownModel::learn(double excess_before, double trace_before, double excess_after,
                          double trace_after) {
    if (!(trace_before > 0) || !(trace_after > 0)) return;
    if (!(excess_before > excess_after)) return;
    const double times = std::max(1.0, trace_before / trace_after);
    const double x = std::max(excess_before - excess_after * times, 0.0);
    const double y = std::min(times - 1, kMostPerVisit * first_per_visit_ * x);
    weight_ = kMemory * weight_ + x * x;
    weighted_ = kMemory * weighted_ + x * y;
}

}  // namespace mray
