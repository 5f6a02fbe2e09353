// What a rotten tree costs in tracing, learned from the trees that replaced rotten ones.
#pragma once

namespace morphray {

/// Tracing slows down like a power of the cost ratio: slow-down = ratio^exponent. The exponent goes
/// by scene, view and tracer (measured: packets of camera rays 0.1 to 0.3, single rays up to 1), so
/// it is estimated: by least squares over the logarithms of what replaced trees have shown, recent
/// ones counting more, drawn to a first guess while little is known.
class SlowdownModel {
public:
    /// Of a ratio of infinity: infinite; of one up to 1: 1.
    double slowdown(double cost_ratio) const;
    double exponent() const;

    /// A tree of `ratio_before` was traced in `trace_before`, the next frame's new tree of
    /// `ratio_after` in `trace_after` (any unit). Ignored when there is nothing to be learned from
    /// it: a time of 0, or a ratio that fell by nothing or from infinity.
    void learn(double ratio_before, double trace_before, double ratio_after, double trace_after);

private:
    double weight_ = 0;
    double weighted_exponent_ = 0;
};

}  // namespace morphray
