// Errors that a user, a file or a device causes, each with the exit code that the program ends
// with. A broken invariant of our own is an assert; "no hit" is a value.
#pragma once

#include <stdexcept>
#include <string>

namespace morphray {

/// Exit codes of the program (README, "Exit codes").
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
    kInterrupted = 130,
    kTerminated = 143,
};

/// what() is one line, `file:line: what is wrong; what to do` where there is a file and a line.
class Error : public std::runtime_error {
public:
    Error(ExitCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
    ExitCode code() const { return code_; }

private:
    ExitCode code_;
};

}  // namespace morphray
