#include "app/process.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "app/backends/device_check.h"

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
