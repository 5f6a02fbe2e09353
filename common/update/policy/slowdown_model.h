// What a degraded tree costs in tracing, learned from the trees that replaced degraded ones.
#pragma once

namespace morphray {

/// Tracing slows down like a power of the cost ratio: slow-down = ratio^exponent. The exponent goes
/// by scene, view and tracer (measured: packets of camera rays 0 to 0.3, single rays up to 1), so
/// it is estimated: by least squares over the logarithms of what replaced trees have shown, recent
/// ones counting more. Before there is such, and beside it with a weight of its own, stands a
/// guess, drawn to how traces have gone while the present tree rotted.
class SlowdownModel {
public:
    /// A guess from 0 to 1.25.
    explicit SlowdownModel(double first_exponent) : first_exponent_(first_exponent) {}

    /// Of a ratio of infinity: infinite; of one up to 1: 1.
    double slowdown(double cost_ratio) const;
    double exponent() const;

    /// A tree of `ratio_before` was traced in `trace_before`, the next frame's new tree of
    /// `ratio_after` in `trace_after` (any unit). Ignored when there is nothing to be learned from
    /// it: a time of 0, or a ratio that fell by nothing or from infinity.
    void learn(double ratio_before, double trace_before, double ratio_after, double trace_after);

    /// A frame of the tree that is in use. Weaker evidence: what the image shows changes, too.
    void watch(double cost_ratio, double trace);
    /// The next watch() is of a new tree.
    void forget_watched() { first_trace_ = 0; }

private:
    double first_exponent_;
    double weight_ = 0;
    double weighted_exponent_ = 0;
    /// Of the first frame of the present tree; 0 while there is none.
    double first_ratio_ = 1;
    double first_trace_ = 0;
    double watched_weight_ = 0;
    double watched_exponent_ = 0;
};

}  // namespace morphray
