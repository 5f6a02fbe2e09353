#include "app/program.h"

#include <fmt/format.h>

#include <new>
#include <stdexcept>
#include <system_error>

#include "app/cli/command_line.h"
#include "app/commands/commands.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/messages.h"

namespace mray::app {
namespace {

ExitCode run_command(const Options& options, const Messages& messages) {
    switch (options.command) {
        case Command::kRender:
            return run_render(options, messages);
        case Command::kCrosscheck:
            return run_crosscheck(options, messages);
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
        case Command::kDevices:
            return run_devices(options, messages);
    }
    throw Error(ErrorKind::kInternal, "no such command");
}

}  // namespace

ExitCode explain_failure(const std::exception_ptr& failure, const Messages& messages) {
    try {
        std::rethrow_exception(failure);
    } catch (const Error& error) {
        messages.error(error);
        return error.kind() == ErrorKind::kCancelled ? interrupt_exit_code()
                                                     : exit_code_of(error.kind());
    } catch (const std::bad_alloc&) {
        messages.error("out of memory; choose a smaller scene or image, or raise the limit");
        return ExitCode::kLimit;
    } catch (const std::length_error&) {
        messages.error("something is larger than memory can be; choose a smaller scene or image");
        return ExitCode::kLimit;
    } catch (const std::system_error& error) {
        if (error.code() == std::errc::resource_unavailable_try_again) {
            messages.error("no more threads can be started; use --threads 1 or raise the limit");
            return ExitCode::kLimit;
        }
        messages.error(fmt::format("internal error: {}; please report it", error.what()));
    } catch (const std::exception& error) {
        messages.error(fmt::format("internal error: {}; please report it", error.what()));
    } catch (...) {
        messages.error("internal error: unknown exception; please report it");
    }
    return ExitCode::kInternal;
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
        return static_cast<int>(run_command(*parsed.options, messages));
    } catch (...) {
        return static_cast<int>(explain_failure(std::current_exception(), messages));
    }
}

}  // namespace mray::app
