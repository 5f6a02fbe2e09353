#include "app/program.h"

#include "app/cli/command_line.h"
#include "app/terminal/failure.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/messages.h"

namespace mray::app {

ExitCode explain_failure(const std::exception_ptr& failure, const Messages& messages) {
    const Failure described = describe_failure(failure);
    messages.error(described.message);
    return described.code;
}

int run_program(std::span<const std::string> arguments, CommandRunner run_command) {
    handle_signals();
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
