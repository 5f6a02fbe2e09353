// Errors that an argument, a file or a device causes. A broken invariant of the code is an assert;
// "no hit" is a value.
#pragma once

#include <stdexcept>
#include <string>

namespace mray {

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

/// A setting under which the work would have succeeded. The message does not name it, because each
/// caller has its own name for it: an option of the program, a member of a struct.
enum class Remedy {
    kNone,
    kLenient,         // ClipOptions::lenient
    kAllowEmpty,      // ClipOptions::allow_empty
    kReplaceMissing,  // ClipOptions::missing other than kFail
};

/// what() is one line, `file:line: what is wrong; what to do` where there is a file and a line.
class Error : public std::runtime_error {
public:
    Error(ErrorKind kind, const std::string& message, Remedy remedy = Remedy::kNone)
        : std::runtime_error(message), kind_(kind), remedy_(remedy) {}
    ErrorKind kind() const { return kind_; }
    Remedy remedy() const { return remedy_; }

private:
    ErrorKind kind_;
    Remedy remedy_;
};

}  // namespace mray
