// Failures in words and as exit codes (docs/guide/options.md).
#pragma once

#include <exception>
#include <string>

#include "common/base/errors.h"

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

/// The exit code of a command that ended with an error of this kind; that of a signal for
/// kCancelled.
ExitCode exit_code_of(ErrorKind kind);

/// The option that would avoid an error, such as " or accept it with --lenient"; empty for
/// Hint::kNone.
const char* hint_text(Hint hint);

/// The error's message with the option that would avoid it.
std::string message_of(const Error& error);

struct Failure {
    /// One line, which says what to do.
    std::string message;
    ExitCode code = ExitCode::kInternal;
};

/// Describes any exception.
Failure describe_failure(const std::exception_ptr& failure);

}  // namespace mray::app
