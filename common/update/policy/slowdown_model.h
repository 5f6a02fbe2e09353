// The slow-down of traces by a degraded tree, learned from the trees that replaced degraded ones.
#pragma once

namespace mray {

/// Tracing slows down like a power of the cost ratio: slow-down = ratio^exponent. The exponent
/// depends on scene, view and tracer (measured: 0 to 0.3 for packets of camera rays, up to 1 for
/// single rays). So it is estimated by least squares over the logarithms of ratios and times at
/// replaced trees, with more weight for recent ones. A guess with a weight of its own is added to
/// them; the traces of the present tree, as it degrades, correct the guess.
class SlowdownModel {
public:
    /// A guess from 0 to 1.25.
    explicit SlowdownModel(double first_exponent) : first_exponent_(first_exponent) {}

    /// 1 for ratios up to 1, infinite for an infinite one.
    double slowdown(double cost_ratio) const;
    double exponent() const;

    /// Learns from a replaced tree: a trace of `trace_before` at `ratio_before`, and of
    /// `trace_after` in the next frame with the new tree at `ratio_after` (times in any unit). Does
    /// nothing if a time is 0, or if the ratio did not fall or fell from infinity.
    void learn(double ratio_before, double trace_before, double ratio_after, double trace_after);

    /// Learns from a frame of the tree in use. This is weaker evidence, since the image changes,
    /// too.
    void watch(double cost_ratio, double trace);
    /// Makes the next watch() the first one of a new tree.
    void forget_watched() { first_trace_ = 0; }

private:
    double first_exponent_;
    double weight_ = 0;
    double weighted_exponent_ = 0;
    /// Ratio and time of the first frame of the present tree; a time of 0 before it.
    double first_ratio_ = 1;
    double first_trace_ = 0;
    double watched_weight_ = 0;
    double watched_exponent_ = 0;
};

}  // namespace mray
