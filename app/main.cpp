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

constexpr std::pair<const char*, ExitCode (*)(const Options&, const Messages&)> kCommands[] = {
    {"render", run_render}, {"view", run_view},      {"crosscheck", run_crosscheck},
    {"diff", run_diff},     {"probe", run_probe},    {"profile", run_profile},
    {"trace", run_trace},   {"query", run_query},    {"chart", run_chart},
    {"info", run_info},     {"devices", run_devices}};

ExitCode run_program(int argc, char** argv) {
    Messages messages;
    Failure end;
    attempt(end, messages, [&] {
        if (run_check_child(argc, argv)) return;
        const ParsedCommandLine parsed =
            parse_command_line(std::vector<std::string>(argv + (argc > 0 ? 1 : 0), argv + argc));
        messages.print(parsed.text);
        if (!parsed.options) return;
        messages = Messages(parsed.options->quiet, parsed.options->verbose);
        for (const auto& [name, run_command] : kCommands)
            if (parsed.options->command == name) end.code = run_command(*parsed.options, messages);
    });
    return end.code;
}

}  // namespace
}  // namespace mray::app

int main(int argc, char** argv) {
    using namespace mray::app;
    hold_standard_descriptors();
    handle_signals();
    end_process(run_program(argc, argv));
}
