// Turns SIGINT, SIGTERM, SIGHUP and SIGPIPE into a state that long work polls.
#pragma once

#include <signal.h>

#include <array>
#include <atomic>

#include "app/base/exit_code.h"

namespace mray::app {

/// While it lives, the first SIGINT, SIGTERM or SIGHUP only makes interrupted() true, the second
/// one ends the process at once, and SIGPIPE is ignored (a write to a closed pipe fails with
/// EPIPE). A signal that was ignored before (nohup, background jobs) stays ignored. The destructor
/// restores the handlers; interrupted() keeps its value. At most one exists at a time.
class InterruptGuard {
public:
    InterruptGuard();
    ~InterruptGuard();
    InterruptGuard(const InterruptGuard&) = delete;
    InterruptGuard& operator=(const InterruptGuard&) = delete;

private:
    std::array<struct sigaction, 4> before_;
};

/// Whether SIGINT, SIGTERM or SIGHUP has arrived since the last guard was made. Thread-safe.
bool interrupted();

/// True as interrupted() is: for calls that take a flag by which they are cancelled.
const std::atomic<bool>& interrupt_flag();

/// Throws Error(kCancelled) after SIGINT, SIGTERM or SIGHUP. Called between frames, so that
/// finished frames are kept and no file is half written.
void throw_if_interrupted();

/// kTerminated after SIGTERM, kHungUp after SIGHUP, otherwise kInterrupted.
ExitCode interrupt_exit_code();

}  // namespace mray::app
