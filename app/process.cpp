#include "app/process.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "app/backends/device_check.h"
#include "app/base/exit_code.h"

namespace mray::app {
namespace {

// If stdin, stdout or stderr is closed, the next file that is opened would take its descriptor and
// receive output. Opening /dev/null for the other direction occupies it, and its use keeps failing.
void hold_standard_descriptors() {
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (::fcntl(fd, F_GETFD) >= 0) continue;
        const int held = ::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
        if (held < 0) return;
    }
}

/// Says which exception nothing caught.
std::terminate_handler default_terminate = nullptr;

/// Replaces the end of a process whose memory does not suffice where nothing catches that, such as
/// in static objects. Memory must not be asked for here.
[[noreturn]] void on_terminate() noexcept {
    try {
        if (std::current_exception()) std::rethrow_exception(std::current_exception());
    } catch (const std::bad_alloc&) {
        constexpr std::string_view kMessage = "morphray: out of memory; raise the limit\n";
        [[maybe_unused]] const ssize_t written =
            ::write(STDERR_FILENO, kMessage.data(), kMessage.size());
        std::_Exit(static_cast<int>(ExitCode::kLimit));
    } catch (...) {
        // Another exception, or none: as without this handler.
    }
    default_terminate();
    std::abort();
}

/// Runs before the static objects of the program are made.
[[gnu::constructor(101)]] void handle_termination() {
    default_terminate = std::set_terminate(on_terminate);
}

/// Ends the process. Destructors of libraries do not run: after a failed allocation Vulkan's loader
/// leaves a mutex locked for which its own destructor waits. Sanitizers and coverage need exit().
[[noreturn]] void end_process(int code) {
    std::fflush(nullptr);
#ifdef MORPHRAY_RUNS_EXIT_HANDLERS
    std::exit(code);
#else
    std::_Exit(code);
#endif
}

}  // namespace

void run_process(int argc, char** argv, CommandRunner run_command) {
    hold_standard_descriptors();
    allow_check_in_child();
    const std::vector<std::string> arguments(argv + (argc > 0 ? 1 : 0), argv + argc);
    end_process(run_program(arguments, run_command));
}

}  // namespace mray::app
