#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <new>

#include "app/animation/devices.h"
#include "app/cli/command_line.h"
#include "app/commands/commands.h"

namespace mray::app {
namespace {

// A closed stdin, stdout or stderr would let the next opened file receive output. /dev/null, opened
// for the other direction, occupies it, and its use keeps failing.
void hold_standard_descriptors() {
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (::fcntl(fd, F_GETFD) >= 0) continue;
        if (::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
    }
}

/// Without destructors: after a failed allocation Vulkan's loader would wait for its own mutex.
[[noreturn]] void end_process(ExitCode code) {
    std::fflush(nullptr);
#ifdef MORPHRAY_RUNS_EXIT_HANDLERS
    std::exit(static_cast<int>(code));
#else
    std::_Exit(static_cast<int>(code));
#endif
}

/// Memory also runs out where nothing may be thrown: in functions of CLI11, when JSON is freed, and
/// before main().
[[gnu::constructor(101)]] void end_without_memory() {
    std::set_new_handler([] {
        is_out_of_memory = true;
        throw std::bad_alloc();
    });
    std::set_terminate([] {
        if (!is_out_of_memory) std::abort();
        // Takes no memory.
        std::fprintf(stderr, "morphray: %s\n", kOutOfMemory);
        std::_Exit(static_cast<int>(ExitCode::kLimit));
    });
}

ExitCode run_program(const std::vector<std::string>& arguments) {
    Messages messages;
    Failure end;
    attempt(end, messages, [&] {
        const ParsedCommandLine parsed = parse_command_line(arguments);
        messages = Messages(parsed.quiet, parsed.verbose);
        messages.print(parsed.text);
        if (parsed.options)
            end.code =
                std::visit([&](const auto& options) { return run_command(options, messages); },
                           *parsed.options);
    });
    return end.code;
}

}  // namespace
}  // namespace mray::app

int main(int argc, char** argv) {
    using namespace mray::app;
    hold_standard_descriptors();
    allow_check_in_child();
    handle_signals();
    end_process(run_program({argv + (argc > 0 ? 1 : 0), argv + argc}));
}
