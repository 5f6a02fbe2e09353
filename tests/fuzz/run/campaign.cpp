#include "tests/fuzz/run/campaign.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "app/terminal/interrupt.h"
#include "cpu/cpu_backend.h"

namespace mray::fuzz {
std::string summary(const Tally& tally, double seconds) {
    if (tally.questions > 0 && tally.images == 0) {
        return fmt::format(
            "{} cases, {} rays and points, {:.1f} s ({:.0f} a second), {} cases differ",
            tally.cases, tally.questions, seconds,
            static_cast<double>(tally.questions) / std::max(seconds, 1e-3), tally.failed_cases);
    }
    return fmt::format(
        "{} cases ({} without an image), {} images ({} near a plane), {} rays, {:.1f} s ({:.0f} "
        "images a second), {} cases and {} images differ",
        tally.cases, tally.refused, tally.images, tally.images_near_a_plane, tally.rays, seconds,
        static_cast<double>(tally.images) / std::max(seconds, 1e-3), tally.failed_cases,
        tally.failed_images);
}

WorkerProgress::WorkerProgress(const Worker& worker) : name_(worker.name()) {}

double WorkerProgress::seconds() const { return watch_.ms() / 1000; }

void WorkerProgress::update(const Tally& tally) {
    if (seconds() < next_) return;
    next_ = seconds() + kSeconds;
    std::fprintf(stderr, "fuzz: %s: %s\n", name_.c_str(), summary(tally, seconds()).c_str());
}

int run_campaign(const CampaignConfig& config, const Worker& worker, WorkerState& state,
                 std::atomic<std::uint64_t>& failures) {
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend({.threads = 1});
    const Variants variants = worker.vulkan ? vulkan_variants() : cpu_variants();
    Referee referee(*brute);
    WorkerProgress progress(worker);
    const auto try_seed = [&](std::uint64_t seed, const std::vector<Variant>& group) {
        state.current = seed;
        FuzzCase fuzz_case = config.asks_questions ? make_questions(seed) : make_case(seed);
        fuzz_case.rays = with_ends_at_hits(*brute, fuzz_case);
        const std::vector<Finding> findings = check_case(referee, fuzz_case, group, state.tally);
        if (!findings.empty()) {
            ++failures;
            report_failure(config.failure, fuzz_case, findings,
                           fmt::format("{}{}-{}", config.asks_questions ? "questions-" : "",
                                       worker.name(), seed),
                           referee);
        }
        progress.update(state.tally);
    };
    if (config.only_case) {
        for (const auto& group : variants.groups) try_seed(*config.only_case, group);
        return 0;
    }
    for (std::uint64_t index = worker.index;; index += worker.count) {
        if (config.cases > 0 && index >= config.cases) break;
        if (config.seconds > 0 && progress.seconds() >= config.seconds) break;
        if (failures >= config.most_failures || app::interrupted()) break;
        try_seed(case_seed(config.seed, index),
                 variants.groups[(index / worker.count) % variants.groups.size()]);
    }
    return 0;
}

}  // namespace mray::fuzz
