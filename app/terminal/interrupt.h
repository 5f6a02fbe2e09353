// SIGINT, SIGTERM and SIGPIPE, made into something that long work can ask for.
#pragma once

#include <signal.h>

#include <array>

#include "app/cli/exit_code.h"

namespace morphray::app {

/// While it lives, the first SIGINT or SIGTERM only makes interrupted() true, the second one ends
/// the process at once, and SIGPIPE is ignored (a write to a pipe that nobody reads fails with
/// EPIPE). A signal that was ignored before (nohup, background jobs) stays ignored. Afterwards
/// everything is as before, but interrupted() keeps its answer. One at a time, made in main().
class InterruptGuard {
public:
    InterruptGuard();
    ~InterruptGuard();
    InterruptGuard(const InterruptGuard&) = delete;
    InterruptGuard& operator=(const InterruptGuard&) = delete;

private:
    std::array<struct sigaction, 3> before_;
};

/// Whether SIGINT or SIGTERM has come since the last guard was made. Any thread may ask.
bool interrupted();

/// To be called between frames: throws Error(kCancelled) after SIGINT or SIGTERM, so that finished
/// frames are kept and no file is half written.
void throw_if_interrupted();

/// kTerminated after SIGTERM, otherwise kInterrupted.
ExitCode interrupt_exit_code();

}  // namespace morphray::app
