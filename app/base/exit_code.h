// Exit codes of the program (docs/guide/options.md).
#pragma once

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

/// The exit code of a command that ended with an error of this kind. kCancelled gives kInterrupted;
/// a caller that knows the signal gives its code instead.
ExitCode exit_code_of(ErrorKind kind);

}  // namespace mray::app
