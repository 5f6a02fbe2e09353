// Errors that an argument, a file or a device causes. A broken invariant of the code is an assert;
// "no hit" is a value.
#pragma once

#include <stdexcept>
#include <string>

namespace morphray {

enum class ErrorKind {
    kBadArgument,  // of a call or of the command line
    kBadInput,     // a file or array that cannot be used
    kUnavailable,  // a backend or device that cannot be had
    kOutput,       // a file that cannot be written
    kLimit,        // more memory, threads or device resources than there are
    kDeviceLost,   // the device stopped answering
    kCancelled,    // the caller asked the work to end
    kInternal,     // a broken invariant that was detected
};

/// what() is one line, `file:line: what is wrong; what to do` where there is a file and a line.
class Error : public std::runtime_error {
public:
    Error(ErrorKind kind, const std::string& message) : std::runtime_error(message), kind_(kind) {}
    ErrorKind kind() const { return kind_; }

private:
    ErrorKind kind_;
};

}  // namespace morphray
