#include "app/terminal/failure.h"

#include <fmt/format.h>

#include <csignal>
#include <new>
#include <stdexcept>

#include "app/terminal/interrupt.h"
#include "common/base/thread_arena.h"
#include "common/base/watch.h"

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
            return static_cast<ExitCode>(128 + interrupt_signal());
        case ErrorKind::kInternal:
            break;
    }
    return ExitCode::kInternal;
}

const char* hint_text(Hint hint) {
    switch (hint) {
        case Hint::kLenient:
            return " or accept it with --lenient";
        case Hint::kReplaceMissing:
            return ", or use --missing hold or --missing skip";
        default:
            return "";
    }
}

std::string message_of(const Error& error) {
    // Work that was given the flag of the signal does not know of signals.
    if (error.what() == std::string(kWorkCancelled))
        return std::string(interrupt_signal() == SIGTERM ? "terminated" : "interrupted") +
               "; finished results are kept";
    return std::string(error.what()) + hint_text(error.hint());
}

Failure describe_failure(const std::exception_ptr& failure) {
    std::string internal;
    try {
        std::rethrow_exception(failure);
    } catch (const Error& error) {
        return {message_of(error), exit_code_of(error.kind())};
    } catch (const std::bad_alloc&) {
        return {"out of memory; choose a smaller scene or image, or raise the limit",
                ExitCode::kLimit};
    } catch (const std::length_error&) {
        return {"something is larger than memory can be; choose a smaller scene or image",
                ExitCode::kLimit};
    } catch (const std::exception& error) {
        if (is_lack_of_threads(error)) {
            return {"no more threads can be started; use --threads 1 or raise the limit",
                    ExitCode::kLimit};
        }
        internal = error.what();
    } catch (...) {
        internal = "unknown exception";
    }
    return {fmt::format("internal error: {}; please report it", internal), ExitCode::kInternal};
}

}  // namespace mray::app
