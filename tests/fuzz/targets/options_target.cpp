// The command line.
#include <exception>
#include <string>
#include <vector>

#include "app/cli/command_line.h"
#include "app/terminal/failure.h"
#include "tests/fuzz/targets/targets.h"

namespace mray::fuzz {
namespace {

std::vector<std::string> arguments_of(std::string_view bytes) {
    std::vector<std::string> arguments;
    while (!bytes.empty()) {
        const std::size_t length = std::min(bytes.find('\0'), bytes.size());
        arguments.emplace_back(bytes.substr(0, length));
        bytes.remove_prefix(std::min(length + 1, bytes.size()));
    }
    return arguments;
}

}  // namespace

std::string options_failure(std::string_view bytes) {
    try {
        const app::ParsedCommandLine parsed = app::parse_command_line(arguments_of(bytes));
        return parsed.options || !parsed.text.empty() ? "" : "neither options nor a text";
    } catch (...) {
        const app::Failure failure = app::describe_failure(std::current_exception());
        const bool is_usage =
            failure.code == app::ExitCode::kUsage || failure.code == app::ExitCode::kLimit;
        return is_usage && !failure.message.empty() ? "" : failure.message;
    }
}

}  // namespace mray::fuzz
