// The slow-down of traces by a degraded tree, learned from the trees that replaced degraded ones.
#pragma once

namespace mray {

/// A trace takes 1 + per_visit * excess times as long as that of a sound tree, with excess as
/// excess_visits() (common/update/tree_cost.h). The factor depends on scene, view and tracer
/// (measured on packets of camera rays: 0.0002 to 0.001 on the CPU, 0.0015 to 0.003 on lavapipe).
/// So it is estimated by least squares over the excess and the times of replaced trees, with more
/// weight for recent ones. A guess with a weight of its own is added to them; the traces of the
/// present tree, as it degrades, correct the guess.
class SlowdownModel {
public:
    /// A guess above 0.
    explicit SlowdownModel(double first_per_visit);

    /// At least 1; 1 for an excess of 0.
    double slowdown(double excess) const { return 1 + per_visit() * excess; }
    double per_visit() const;

    /// Learns from a replaced tree: a trace of `trace_before` at `excess_before`, and of
    /// `trace_after` in the next frame with the new tree at `excess_after` (times in any unit).
    /// Does nothing if a time is 0, or if the excess did not fall.
    void learn(double excess_before, double trace_before, double excess_after, double trace_after);

    /// Learns from a frame of the tree in use. This is weaker evidence, since the image changes,
    /// too.
    void watch(double excess, double trace);
    /// Makes the next watch() the first one of a new tree.
    void forget_watched() { first_trace_ = 0; }

private:
    double first_per_visit_;
    double first_weight_;
    double weight_ = 0;
    double weighted_ = 0;
    /// Excess and time of the first frame of the present tree; a time of 0 before it.
    double first_excess_ = 0;
    double first_trace_ = 0;
    double watched_weight_ = 0;
    double watched_ = 0;
};

}  // namespace mray
