// Failures in words and as exit codes (docs/guide/options.md), and signals.
#pragma once

#include <atomic>
#include <exception>
#include <string>
#include <utility>

#include "common/base/errors.h"
#include "morphray/error.hpp"

namespace mray::app {

enum class ExitCode : int {
    kOk = 0,
    kCheckFailed = 1,
    kUsage = 2,
    kBadInput = 3,
    kUnavailable = 4,
    kOutput = 5,
    kLimit = 6,
    kDeviceLost = 7,
    kPartial = 8,
    kInternal = 70,
    kHungUp = 129,
    kInterrupted = 130,
    kTerminated = 143,
};

/// The kind of error that has the exit code of this one.
ErrorKind kind_of(morphray::ErrorCode code);

/// Calls `work` of the library; its errors come out as those of the program.
template <class Work>
decltype(auto) call_library(Work&& work) {
    try {
        return std::forward<Work>(work)();
    } catch (const morphray::Error& error) {
        throw Error(kind_of(error.code()), error.what());
    }
}

/// kCancelled has the code of its signal.
ExitCode exit_code_of(ErrorKind kind);

/// The option that would avoid an error, such as " or accept it with --lenient", or empty.
const char* hint_text(Hint hint);

std::string message_of(const Error& error);

struct Failure {
    /// One line, which says what to do.
    std::string message;
    ExitCode code = ExitCode::kOk;
};

/// Whether an allocation has failed.
inline std::atomic<bool> is_out_of_memory = false;

Failure describe_failure(const std::exception_ptr& failure);

/// The first signal sets the flag, the second ends the process. Ignored ones (nohup) stay so.
void handle_signals();

/// The flag is true once a signal has arrived. Calls that can be cancelled take it.
const std::atomic<bool>& interrupt_flag();
inline bool interrupted() { return interrupt_flag().load(); }
/// The signal that has arrived; SIGINT without one.
int interrupt_signal();

/// Called between pieces of work, so that no file is half written. Throws Error(kCancelled).
void throw_if_interrupted();

}  // namespace mray::app
