// Turns SIGINT, SIGTERM, SIGHUP and SIGPIPE into a state that long work polls.
#pragma once

#include <signal.h>

#include <array>
#include <atomic>
#include <filesystem>
#include <span>
#include <string>

#include "app/base/exit_code.h"

namespace mray::app {

/// While it lives, the first SIGINT, SIGTERM or SIGHUP makes interrupted() true, the second one
/// ends the process at once, and SIGPIPE is ignored (a write to a closed pipe fails with EPIPE). A
/// signal that was ignored before (nohup, background jobs) stays ignored. The destructor restores
/// the handlers; interrupted() keeps its value. At most one exists at a time.
///
/// If throw_if_interrupted() has not thrown kGraceMs after the first signal, because code of others
/// such as a driver's compiler is at work, the process ends there: with the line and the exit code
/// that the error would have led to. Outputs are whole or absent then, too.
class InterruptGuard {
public:
    InterruptGuard();
    ~InterruptGuard();
    InterruptGuard(const InterruptGuard&) = delete;
    InterruptGuard& operator=(const InterruptGuard&) = delete;

    static constexpr long kGraceMs = 120;

private:
    std::array<struct sigaction, 5> before_;
};

/// Whether SIGINT, SIGTERM or SIGHUP has arrived since the last guard was made. Thread-safe.
bool interrupted();

/// True as interrupted() is: for calls that take a flag by which they are cancelled.
const std::atomic<bool>& interrupt_flag();

/// Throws Error(kCancelled) after SIGINT, SIGTERM or SIGHUP, which describe_failure() words as
/// interrupt_message(). Called between pieces of work, so that what is finished is kept and no file
/// is half written.
void throw_if_interrupted();

/// The line of an interruption: "interrupted; finished results are kept", or as tell_results()
/// says. Thread-safe.
std::string interrupt_message();

/// Says what is finished, such as "2 of 3 frames are done (0,1)" or "nothing is written", and where
/// it lies, for the line of an interruption; either may be empty. Thread-safe.
void tell_results(const std::string& finished, const std::string& place);

/// A folder that is removed with all that is in it, if the process ends at the end of the grace
/// while this lives. At most one exists at a time.
class RemovedAtEnd {
public:
    explicit RemovedAtEnd(const std::filesystem::path& folder);
    ~RemovedAtEnd();
    RemovedAtEnd(const RemovedAtEnd&) = delete;
    RemovedAtEnd& operator=(const RemovedAtEnd&) = delete;

private:
    std::string folder_;
};

/// "12 of 25 frames are done (0..11)", of units with this name and these numbers, which ascend.
std::string finished_text(const std::string& unit, std::span<const double> finished,
                          std::size_t total);

/// kTerminated after SIGTERM, kHungUp after SIGHUP, otherwise kInterrupted.
ExitCode interrupt_exit_code();

/// While it lives the grace after a signal ends as if throw_if_interrupted() had not thrown, some
/// milliseconds from now at the earliest: for waits on the way out whose results may be lost. One
/// within another changes nothing.
class EndOfGrace {
public:
    EndOfGrace();
    ~EndOfGrace();
    EndOfGrace(const EndOfGrace&) = delete;
    EndOfGrace& operator=(const EndOfGrace&) = delete;

private:
    bool is_set_;
};

}  // namespace mray::app
