#include "app/program.h"

#include "app/base/memory_budget.h"
#include "app/cli/command_line.h"
#include "app/commands/commands.h"
#include "app/terminal/failure.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/messages.h"

namespace mray::app {
namespace {

ExitCode run_command(const Options& options, const Messages& messages) {
    switch (options.command) {
        case Command::kRender:
            return run_render(options, messages);
        case Command::kView:
            return run_view(options, messages);
        case Command::kCrosscheck:
            return run_crosscheck(options, messages);
        case Command::kMerge:
            return run_merge(options, messages);
        case Command::kDiff:
            return run_diff(options, messages);
        case Command::kProbe:
            return run_probe(options, messages);
        case Command::kProfile:
            return run_profile(options, messages);
        case Command::kTrace:
            return run_trace(options, messages);
        case Command::kChart:
            return run_chart(options, messages);
        case Command::kInfo:
            return run_info(options, messages);
        case Command::kIndex:
            return run_index(options, messages);
        case Command::kDevices:
            return run_devices(options, messages);
    }
    throw Error(ErrorKind::kInternal, "no such command");
}

}  // namespace

ExitCode explain_failure(const std::exception_ptr& failure, const Messages& messages) {
    const Failure described = describe_failure(failure);
    messages.error(described.message);
    return described.code;
}

int run_program(std::span<const std::string> arguments) {
    const InterruptGuard guard;
    Messages messages;
    try {
        const ParsedCommandLine parsed = parse_command_line(arguments);
        if (!parsed.options) {
            messages.print(parsed.text);
            return static_cast<int>(ExitCode::kOk);
        }
        messages = Messages(*parsed.options);
        if (const auto limit = parsed.options->memory_limit)
            set_memory_limit(*limit, parsed.options->backend.threads);
        return static_cast<int>(run_command(*parsed.options, messages));
    } catch (...) {
        return static_cast<int>(explain_failure(std::current_exception(), messages));
    }
}

}  // namespace mray::app
