#include "tests/fuzz/run/campaign.h"

#include <fmt/format.h>

#include <cstdio>

#include "app/terminal/failure.h"
#include "cpu/cpu_backend.h"
#include "tests/fuzz/generate/generator.h"
#include "tests/fuzz/shrink/report.h"

namespace mray::fuzz {
namespace {

/// Calls `try_seed(seed, group)` for the cases of a process, which alternate between groups.
template <class Group, class TrySeed>
int try_seeds(const FuzzOptions& options, const Process& process, Progress& progress,
              const std::vector<Group>& groups, const TrySeed& try_seed) {
    constexpr double kSecondsAnHour = 3600;
    const double seconds = options.hours * kSecondsAnHour / (options.cpu && options.vulkan ? 2 : 1);
    const auto begin = [&](std::uint64_t seed, const Group& group) {
        progress.begin(seed);
        try_seed(seed, group);
    };
    if (options.only_case) {
        for (const Group& group : groups) begin(*options.only_case, group);
        return progress.finish();
    }
    for (std::uint64_t index = process.index; !is_over(options, progress); index += process.count) {
        if (options.cases > 0 && index >= options.cases) break;
        if (seconds > 0 && progress.seconds() >= seconds) break;
        begin(case_seed(options.seed, index), groups[(index / process.count) % groups.size()]);
    }
    return progress.finish();
}

}  // namespace

void Progress::begin(std::uint64_t current) {
    *process_.current = current;
    if (seconds() < next_) return;
    next_ = seconds() + kSeconds;
    fmt::print(stderr, "fuzz: {}\n", summary());
}

int Progress::finish() const {
    fmt::print("{}\n", summary());
    return static_cast<int>(has_failed() ? app::ExitCode::kCheckFailed : app::ExitCode::kOk);
}

std::string Progress::summary() const {
    return fmt::format(
        "{}: {} cases ({} without an image), {} images ({} near a plane), {} rays, {} rays and "
        "points of questions, {:.1f} s, {} cases and {} images differ",
        process_.name(), tally.cases, tally.refused, tally.images, tally.images_near_a_plane,
        tally.rays, tally.questions, seconds(), tally.failed_cases, tally.failed_images);
}

bool is_over(const FuzzOptions& options, const Progress& progress) {
    return progress.tally.failed_cases >= options.most_failures || app::interrupted();
}

int run_campaign(const FuzzOptions& options, const Process& process) {
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend({.threads = 1});
    const Variants variants = process.vulkan ? vulkan_variants() : cpu_variants();
    Referee referee(*brute);
    Progress progress(process);
    const bool asks = options.mode == Mode::kQuestions;
    const auto try_seed = [&](std::uint64_t seed, const std::vector<Variant>& group) {
        FuzzCase fuzz_case = asks ? make_questions(seed) : make_case(seed);
        fuzz_case.rays = with_ends_at_hits(*brute, fuzz_case);
        const std::vector<Finding> findings = check_case(referee, fuzz_case, group, progress.tally);
        if (findings.empty()) return;
        const std::string name =
            fmt::format("{}{}-{}", asks ? "questions-" : "", process.name(), seed);
        report_failure({options.out, name, process.vulkan}, fuzz_case, findings.front(), referee);
    };
    return try_seeds(options, process, progress, variants.groups, try_seed);
}

}  // namespace mray::fuzz
