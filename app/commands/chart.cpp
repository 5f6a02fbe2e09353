// morphray chart, which becomes the program morphray-chart.
#include <unistd.h>

#include <cerrno>

#include "app/commands/commands.h"

namespace mray::app {

ExitCode run_chart(const Options& options, const Messages& messages) {
    constexpr const char* kName = "morphray-chart";
    std::error_code error;
    const std::filesystem::path folder =
        std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
    const std::string program = (folder / MORPHRAY_CHART_FOLDER / kName).lexically_normal();
    std::vector<std::string> arguments = {
        kName, options.out,
        fmt::format("-{}{}{}", options.quick ? "q" : "", options.source.lenient ? "l" : "",
                    messages.quiet() ? "s" : "")};
    arguments.insert(arguments.end(), options.inputs.begin(), options.inputs.end());
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
