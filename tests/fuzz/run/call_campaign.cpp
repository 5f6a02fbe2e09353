#include "tests/fuzz/run/call_campaign.h"

#include <fmt/format.h>

#include "app/terminal/interrupt.h"
#include "tests/fuzz/generate/calls.h"
#include "tests/fuzz/shrink/call_failure.h"

namespace mray::fuzz {

const std::vector<std::vector<CallDevices>>& call_devices(const Worker& worker) {
    // A worker is a process.
    static const std::vector<std::vector<CallDevices>> groups =
        worker.vulkan ? vulkan_call_devices() : cpu_call_devices();
    return groups;
}

int run_calls(const CampaignConfig& config, const Worker& worker, WorkerState& state,
              std::atomic<std::uint64_t>& failures) {
    const auto& groups = call_devices(worker);
    WorkerProgress progress(worker);
    const auto try_seed = [&](std::uint64_t seed, const std::vector<CallDevices>& group) {
        state.current = seed;
        const FuzzCase fuzz_case = make_calls(seed);
        const CallModel model(fuzz_case);
        ++state.tally.cases;
        state.tally.questions += model.question_count();
        for (const CallDevices& devices : group) {
            const std::optional<CallDifference> found = model.compare(devices);
            if (!found) continue;
            ++failures;
            ++state.tally.failed_cases;
            report_call_failure(config.failure, fuzz_case, *found, devices,
                                fmt::format("calls-{}-{}", worker.name(), seed));
            break;
        }
        progress.update(state.tally);
    };
    if (config.only_case) {
        for (const auto& group : groups) try_seed(*config.only_case, group);
        return 0;
    }
    for (std::uint64_t index = worker.index;; index += worker.count) {
        if (config.cases > 0 && index >= config.cases) break;
        if (config.seconds > 0 && progress.seconds() >= config.seconds) break;
        if (failures >= config.most_failures || app::interrupted()) break;
        try_seed(case_seed(config.seed, index), groups[(index / worker.count) % groups.size()]);
    }
    return 0;
}

}  // namespace mray::fuzz
