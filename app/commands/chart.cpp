// morphray chart, which becomes the program morphray-chart.
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <vector>

#include "app/animation/frames.h"
#include "app/commands/commands.h"
#include "common/base/errors.h"

namespace mray::app {
namespace {

constexpr const char* kName = "morphray-chart";

/// Replaces this process by the program. Returns if there is no such file.
void become(const std::filesystem::path& program, std::vector<std::string> arguments) {
    std::string name = kName;
    std::vector<char*> argv{name.data()};
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    ::execv(program.c_str(), argv.data());
    if (errno == ENOENT || errno == ENOTDIR) return;
    throw Error(ErrorKind::kUnavailable, "{}: cannot be started: {}; install morphray again",
                program.string(), std::generic_category().message(errno));
}

std::vector<std::string> chart_arguments(const ChartOptions& options, bool quiet) {
    const std::string flags = fmt::format("-{}{}{}", options.quick ? "q" : "",
                                          options.lenient ? "l" : "", quiet ? "s" : "");
    std::vector<std::string> arguments = {options.out, flags};
    arguments.insert(arguments.end(), options.scenes.begin(), options.scenes.end());
    return arguments;
}

}  // namespace

ExitCode run_command(const ChartOptions& options, const Messages& messages) {
    warn_of_numbered_scenes(options.scenes, messages);
    std::error_code error;
    const std::filesystem::path folder =
        std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
    const std::filesystem::path program =
        (folder / MORPHRAY_CHART_FOLDER / kName).lexically_normal();
    become(program, chart_arguments(options, messages.quiet()));
    throw Error(
        ErrorKind::kUnavailable,
        "chart: {} is missing; build the target morphray_programs, or install morphray again",
        program.string());
}

}  // namespace mray::app
