// morphray chart: becomes the program morphray-chart.
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <vector>

#include "app/commands/commands.h"
#include "app/terminal/interrupt.h"
#include "common/base/errors.h"

namespace mray::app {
namespace {

constexpr const char* kName = "morphray-chart";

/// Replaces this process by the program, which gets all arguments. Returns if there is no such
/// file.
void become(const std::filesystem::path& program, std::vector<std::string> arguments) {
    std::string name = kName;
    std::vector<char*> argv{name.data()};
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    ::execv(program.c_str(), argv.data());
    if (errno == ENOENT || errno == ENOTDIR) return;
    throw Error(ErrorKind::kUnavailable,
                fmt::format("{}: cannot be started: {}; install morphray again", program.string(),
                            std::generic_category().message(errno)));
}

// The other program parses the same arguments with the same code; nothing was written before.
[[noreturn]] void become_chart_program(const ChartOptions& options) {
    std::error_code error;
    const std::filesystem::path folder =
        std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
    if (error) {
        throw Error(ErrorKind::kUnavailable,
                    fmt::format("chart: {} cannot be found: /proc/self/exe: {}; mount /proc", kName,
                                error.message()));
    }
    // In the build folder, and where it is installed.
    for (const char* place : {".", MORPHRAY_CHART_FOLDER})
        become((folder / place / kName).lexically_normal(), options.arguments);
    throw Error(ErrorKind::kUnavailable,
                fmt::format("chart: {} is missing, which belongs beside {}; build the target "
                            "morphray_programs, or install morphray again",
                            kName, (folder / "morphray").string()));
}

}  // namespace

ExitCode run_chart(const ChartOptions& options, const Messages&) {
    throw_if_interrupted();
    become_chart_program(options);
}

}  // namespace mray::app
