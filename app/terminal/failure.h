// A failure in words and as an exit code.
#pragma once

#include <exception>
#include <string>

#include "app/base/exit_code.h"

namespace mray::app {

struct Failure {
    /// One line, which says what to do.
    std::string message;
    ExitCode code = ExitCode::kInternal;
};

/// Describes any exception.
Failure describe_failure(const std::exception_ptr& failure);

}  // namespace mray::app
