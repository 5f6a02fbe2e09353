// one_picture_fuzz: looks for cases in which instruction sets, trees, numbers of threads or devices
// give different images. `./fuzz` at the root of the checkout builds and runs it.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>

#include "app/base/exit_code.h"
#include "app/terminal/interrupt.h"
#include "common/base/errors.h"
#include "tests/fuzz/run/call_campaign.h"
#include "tests/fuzz/run/options.h"
#include "tests/fuzz/run/replay.h"
#include "tests/fuzz/run/sweep.h"

namespace mray::fuzz {
namespace {

/// The program that was built beside this one.
std::filesystem::path program_path() {
    std::error_code error;
    return std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / "morphray";
}

FailureConfig failure_config(const FuzzOptions& options) {
    return {options.out, program_path(), options.only_list};
}

CampaignConfig campaign_config(const FuzzOptions& options, int shares) {
    constexpr double kSecondsAnHour = 3600;
    CampaignConfig config;
    config.seed = options.seed;
    config.cases = options.cases;
    config.seconds = options.hours * kSecondsAnHour / shares;
    config.most_failures = options.most_failures;
    config.only_case = options.only_case;
    config.asks_questions = options.mode == Mode::kQuestions;
    config.failure = failure_config(options);
    return config;
}

WorkerTask work_of(const FuzzOptions& options) {
    switch (options.mode) {
        case Mode::kOnePicture:
        case Mode::kQuestions:
        case Mode::kCalls: {
            const int shares = options.cpu && options.vulkan ? 2 : 1;
            return [config = campaign_config(options, shares),
                    run = options.mode == Mode::kCalls ? run_calls : run_campaign](
                       const Worker& worker, WorkerState& state,
                       std::atomic<std::uint64_t>& failures) {
                return run(config, worker, state, failures);
            };
        }
        case Mode::kSweep:
            return [options, scene_case = open_sweep(options)](
                       const Worker& worker, WorkerState& state,
                       std::atomic<std::uint64_t>& failures) {
                return run_sweep(options, scene_case, failure_config(options), worker, state,
                                 failures);
            };
        case Mode::kReplay:
            break;
    }
    return [cases = read_cases(options.files)](const Worker& worker, WorkerState& state,
                                               std::atomic<std::uint64_t>& failures) {
        return run_replay(cases, worker, state, failures);
    };
}

/// Runs the workers of one kind of backend; returns an exit code.
int run_on(bool vulkan, const FuzzOptions& options, const WorkerTask& work) {
    const bool shares = options.mode != Mode::kReplay && !options.only_case;
    const Worker clock{0, 1, vulkan, 0};
    const WorkerProgress progress(clock);
    const WorkersResult result = run_workers(make_workers(vulkan, shares ? options.jobs : 1), work);
    for (const std::string& accident : result.accidents)
        std::printf("CRASHED %s\n", accident.c_str());
    std::printf("%s: %s\n", vulkan ? "vulkan" : "cpu",
                summary(result.tally, progress.seconds()).c_str());
    std::fflush(stdout);
    if (result.exit_code != 0) return result.exit_code;
    return result.tally.failed_cases > 0 || !result.accidents.empty()
               ? static_cast<int>(app::ExitCode::kCheckFailed)
               : 0;
}

int run(std::span<const std::string> arguments) {
    const std::optional<FuzzOptions> options = parse_fuzz_options(arguments);
    if (!options) {
        std::fputs(fuzz_help(), stdout);
        return 0;
    }
    app::handle_signals();
    const WorkerTask work = work_of(*options);
    int code = 0;
    if (options->cpu) code = run_on(false, *options, work);
    if (options->vulkan && !app::interrupted()) code = std::max(code, run_on(true, *options, work));
    app::throw_if_interrupted();
    return code;
}

}  // namespace
}  // namespace mray::fuzz

int main(int argc, char** argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    try {
        return mray::fuzz::run(arguments);
    } catch (const mray::Error& error) {
        std::fprintf(stderr, "fuzz: %s\n", error.what());
        return static_cast<int>(mray::app::exit_code_of(error.kind()));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "fuzz: internal error: %s\n", error.what());
        return static_cast<int>(mray::app::ExitCode::kInternal);
    }
}
