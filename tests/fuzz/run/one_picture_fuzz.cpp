// one_picture_fuzz: looks for cases in which instruction sets, trees, numbers of threads or devices
// give different images. `tests/fuzz/fuzz` at the root of the checkout builds and runs it.
#include <fmt/format.h>

#include <algorithm>
#include <exception>

#include "app/terminal/failure.h"
#include "common/base/errors.h"
#include "tests/fuzz/run/campaign.h"
#include "tests/fuzz/run/replay.h"

namespace mray::fuzz {
namespace {

std::function<int(const Process&)> work_of(const FuzzOptions& options) {
    switch (options.mode) {
        case Mode::kOnePicture:
        case Mode::kQuestions:
            return [&](const Process& process) { return run_campaign(options, process); };
        case Mode::kReplay:
            break;
    }
    return [cases = read_cases(options.files)](const Process& process) {
        return run_replay(cases, process);
    };
}

int run(const FuzzOptions& options) {
    app::handle_signals();
    const auto work = work_of(options);
    int code = 0;
    if (options.cpu) code = run_processes(false, work);
    if (options.vulkan && !app::interrupted()) code = std::max(code, run_processes(true, work));
    app::throw_if_interrupted();
    return code;
}

}  // namespace
}  // namespace mray::fuzz

int main(int argc, char** argv) {
    try {
        const auto [options, exit_code] = mray::fuzz::parse_fuzz_options(argc, argv);
        return exit_code ? *exit_code : mray::fuzz::run(options);
    } catch (const mray::Error& error) {
        fmt::print(stderr, "fuzz: {}\n", error.what());
        return static_cast<int>(mray::app::exit_code_of(error.kind()));
    } catch (const std::exception& error) {
        fmt::print(stderr, "fuzz: internal error: {}\n", error.what());
        return static_cast<int>(mray::app::ExitCode::kInternal);
    }
}
