// A measure of the machine at the time of a run.
#pragma once

#include <string>

#include "common/base/thread_arena.h"

namespace mray::app {

/// Fixed work of which a run of `profile` takes the time between its stages: dependent integer
/// multiplications, which scale with the clock, in pieces for all threads. It shares no code with
/// the stages, so that the ratio of a stage's time to its own tells a change of the program from
/// one of the machine or its load. It leaves memory alone: beside other guests of a machine, copies
/// vary more than the stages do.
class Yardstick {
public:
    /// Changes whenever the work does, because ratios to other work do not compare.
    static constexpr const char* kName = "multiply, 2";

    /// `threads` as in ThreadArena.
    explicit Yardstick(int threads);

    /// Does the work once; returns milliseconds, some 1.5 on one core of 2024.
    double run_ms();

    /// The part of the time of all runs so far in which its threads did not run, 0 to 1: small on
    /// an idle machine, a half beside as many threads of other programs. Time that a hypervisor
    /// takes counts as time in which they ran.
    double waited() const;

private:
    ThreadArena arena_;
    /// Keeps the compiler from leaving the work out.
    volatile unsigned sum_ = 0;
    /// Times of all threads together.
    double elapsed_ms_ = 0;
    double worked_ms_ = 0;
};

}  // namespace mray::app
