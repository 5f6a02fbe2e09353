// The one exception of the library, and the mark of what the shared library exports.
#pragma once

#include <stdexcept>
#include <string>

#ifdef __GNUC__
#define MORPHRAY_API __attribute__((visibility("default")))
#else
#define MORPHRAY_API
#endif

namespace morphray {

enum class ErrorCode {
    bad_argument,  ///< An argument that no call accepts: sizes that do not fit.
    bad_input,     ///< An array or a file that cannot be used: an index out of range.
    unavailable,   ///< A device or an instruction set that this machine or build does not have.
    output,        ///< A file that cannot be written.
    limit,         ///< More memory, triangles or pixels than the machine, or the library, takes.
    device_lost,   ///< The device stopped answering. The scene is of no use any more.
    busy,          ///< Another thread is changing this scene.
    internal,      ///< A broken invariant of the library: please report it.
    cancelled,     ///< The flag `cancel` of the call asked it to end.
};

/// "bad_argument" for ErrorCode::bad_argument, and so on.
MORPHRAY_API const char* to_string(ErrorCode code) noexcept;

/// The exception that every function of the library throws; there is no other. what() is one line
/// that says what is wrong and, where there is a remedy, what to do. A call that throws has changed
/// nothing, but for device_lost, and for limit or cancelled from a call that changes a scene (Scene
/// says more).
class MORPHRAY_API Error : public std::runtime_error {
public:
    Error(ErrorCode code, const std::string& message);
    ~Error() override;
    Error(const Error&) = default;
    Error& operator=(const Error&) = default;

    ErrorCode code() const noexcept { return code_; }

private:
    ErrorCode code_;
};

}  // namespace morphray
