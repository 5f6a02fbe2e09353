#include "app/program.h"

#include <fmt/format.h>

#include <exception>
#include <new>

#include "app/command_line.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "app/messages.h"

namespace morphray::app {
namespace {

ExitCode run_command(const Options& options, const Messages& messages) {
    switch (options.command) {
        case Command::kRender:
            return run_render(options, messages);
        case Command::kCrosscheck:
            return run_crosscheck(options, messages);
        case Command::kProbe:
            return run_probe(options, messages);
        case Command::kProfile:
            return run_profile(options, messages);
        case Command::kTrace:
            return run_trace(options, messages);
        case Command::kInfo:
            return run_info(options, messages);
        case Command::kDevices:
            return run_devices(options, messages);
    }
    throw Error(ExitCode::kInternal, "no such command");
}

}  // namespace

int run_program(std::span<const std::string> arguments) {
    const InterruptGuard guard;
    Messages messages;
    ExitCode code = ExitCode::kInternal;
    try {
        const ParsedCommandLine parsed = parse_command_line(arguments);
        if (parsed.options) {
            messages = Messages(*parsed.options);
            code = run_command(*parsed.options, messages);
        } else {
            messages.print(parsed.text);
            code = ExitCode::kOk;
        }
    } catch (const Error& error) {
        messages.error(error.what());
        code = error.code();
    } catch (const std::bad_alloc&) {
        messages.error("out of memory; choose a smaller scene or picture, or raise the limit");
        code = ExitCode::kLimit;
    } catch (const std::exception& error) {
        messages.error(fmt::format("internal error: {}; please report it", error.what()));
    } catch (...) {
        messages.error("internal error: unknown exception; please report it");
    }
    return static_cast<int>(code);
}

}  // namespace morphray::app
