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

ExitCode run_command(const ChartOptions& options, const Messages& messages) {
    constexpr const char* kName = "morphray-chart";
    warn_of_numbered_scenes(options.scenes, messages);
    std::error_code error;
    const std::filesystem::path folder =
        std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
    const std::string program = (folder / MORPHRAY_CHART_FOLDER / kName).lexically_normal();
    std::vector<std::string> arguments = {
        kName, options.out,
        fmt::format("-{}{}{}", options.quick ? "q" : "", options.lenient ? "l" : "",
                    messages.quiet() ? "s" : "")};
    arguments.insert(arguments.end(), options.scenes.begin(), options.scenes.end());
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    // Replaces this process, or returns.
    ::execv(program.c_str(), argv.data());
    if (errno == ENOENT || errno == ENOTDIR)
        throw Error(
            ErrorKind::kUnavailable,
            "chart: {} is missing; build the target morphray_programs, or install morphray again",
            program);
    throw Error(ErrorKind::kUnavailable, "{}: cannot be started: {}; install morphray again",
                program, std::generic_category().message(errno));
}

}  // namespace mray::app
