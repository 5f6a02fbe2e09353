#include "app/terminal/failure.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <new>
#include <stdexcept>

#include "common/base/watch.h"

namespace mray::app {
namespace {

std::atomic<int> received_signal = SIGINT;
std::atomic<bool> has_received = false;
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

void on_signal(int signal) {
    if (has_received.exchange(true)) ::_exit(128 + signal);
    received_signal = signal;
}

}  // namespace

// The library's errors have the order of the program's, which is that of the codes from kUsage.
static_assert(static_cast<int>(morphray::ErrorCode::device_lost) ==
              static_cast<int>(ErrorKind::kDeviceLost));
static_assert(static_cast<int>(ExitCode::kDeviceLost) - static_cast<int>(ExitCode::kUsage) ==
              static_cast<int>(ErrorKind::kDeviceLost));

ErrorKind kind_of(morphray::ErrorCode code) {
    if (code == morphray::ErrorCode::cancelled) return ErrorKind::kCancelled;
    return code <= morphray::ErrorCode::device_lost ? static_cast<ErrorKind>(code)
                                                    : ErrorKind::kInternal;
}

ExitCode exit_code_of(ErrorKind kind) {
    if (kind == ErrorKind::kCancelled) return static_cast<ExitCode>(128 + interrupt_signal());
    if (kind == ErrorKind::kInternal) return ExitCode::kInternal;
    return static_cast<ExitCode>(static_cast<int>(ExitCode::kUsage) + static_cast<int>(kind));
}

const char* hint_text(Hint hint) {
    switch (hint) {
        case Hint::kLenient:
            return " or accept it with --lenient";
        case Hint::kReplaceMissing:
            return ", or use --skip-missing";
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
        return {kOutOfMemory, ExitCode::kLimit};
    } catch (const std::length_error&) {
        return {"something is larger than memory can be; choose a smaller scene or image",
                ExitCode::kLimit};
    } catch (const std::exception& error) {
        if (is_out_of_threads(error)) return {kOutOfThreads, ExitCode::kLimit};
        internal = error.what();
    } catch (...) {
        internal = "unknown exception";
    }
    // OpenEXR gives it names of its own.
    if (is_out_of_memory) return {kOutOfMemory, ExitCode::kLimit};
    return {fmt::format("internal error: {}; please report it", internal), ExitCode::kInternal};
}

void handle_signals() {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
        if (::signal(signal, on_signal) == SIG_IGN) ::signal(signal, SIG_IGN);
    ::signal(SIGPIPE, SIG_IGN);
}

const std::atomic<bool>& interrupt_flag() { return has_received; }

int interrupt_signal() { return received_signal; }

void throw_if_interrupted() {
    if (interrupted()) throw Error(ErrorKind::kCancelled, kWorkCancelled);
}

}  // namespace mray::app
