#include "app/base/exit_code.h"

namespace mray::app {

ExitCode exit_code_of(ErrorKind kind) {
    switch (kind) {
        case ErrorKind::kBadArgument:
            return ExitCode::kUsage;
        case ErrorKind::kBadInput:
            return ExitCode::kBadInput;
        case ErrorKind::kUnavailable:
            return ExitCode::kUnavailable;
        case ErrorKind::kOutput:
            return ExitCode::kOutput;
        case ErrorKind::kLimit:
            return ExitCode::kLimit;
        case ErrorKind::kDeviceLost:
            return ExitCode::kDeviceLost;
        case ErrorKind::kCancelled:
            return ExitCode::kInterrupted;
        case ErrorKind::kInternal:
            break;
    }
    return ExitCode::kInternal;
}

}  // namespace mray::app
