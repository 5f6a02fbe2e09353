#include "tests/fuzz/run/replay.h"

#include <fmt/format.h>

#include <cstdio>

#include "common/base/errors.h"
#include "cpu/cpu_backend.h"
#include "tests/fuzz/case/case_text.h"
#include "tests/fuzz/run/call_campaign.h"
#include "tests/fuzz/shrink/call_failure.h"

namespace mray::fuzz {

std::vector<NamedCase> read_cases(const std::vector<std::string>& files) {
    std::vector<NamedCase> cases;
    for (const std::string& file : files) {
        cases.push_back({file, read_case_file(file)});
        if (!cases.back().fuzz_case.calls.empty()) continue;
        // Refuse invalid cases before workers start.
        try {
            const FuzzScene scene(cases.back().fuzz_case);
        } catch (const Error& error) {
            throw Error(error.kind(), fmt::format("{}: {}", file, error.what()));
        }
    }
    return cases;
}

namespace {

/// Plays calls on all devices; returns the number of differences.
int replay_calls(const NamedCase& named, const Worker& worker, WorkerState& state) {
    const CallModel model(named.fuzz_case);
    ++state.tally.cases;
    state.tally.questions += model.question_count();
    int differences = 0;
    for (const auto& group : call_devices(worker)) {
        for (const CallDevices& devices : group) {
            const std::optional<CallDifference> found = model.compare(devices);
            if (!found) continue;
            ++differences;
            std::printf("%s on %s: %s\n", named.name.c_str(), devices.name.c_str(),
                        describe(*found, named.fuzz_case).c_str());
        }
    }
    state.tally.failed_cases += differences > 0 ? 1 : 0;
    return differences;
}

}  // namespace

int run_replay(const std::vector<NamedCase>& cases, const Worker& worker, WorkerState& state,
               std::atomic<std::uint64_t>& failures) {
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend({.threads = 1});
    const Variants variants = worker.vulkan ? vulkan_variants() : cpu_variants();
    Referee referee(*brute);
    for (const NamedCase& named : cases) {
        ++state.current;
        if (!named.fuzz_case.calls.empty()) {
            if (replay_calls(named, worker, state) > 0) ++failures;
            continue;
        }
        std::vector<Finding> findings;
        for (const auto& group : variants.groups) {
            const auto more = check_case(referee, named.fuzz_case, group, state.tally);
            findings.insert(findings.end(), more.begin(), more.end());
        }
        if (findings.empty()) continue;
        ++failures;
        std::printf("%s: %zu differences on %s\n", named.name.c_str(), findings.size(),
                    worker.name().c_str());
        for (const Finding& finding : findings) std::printf("  %s\n", describe(finding).c_str());
    }
    return 0;
}

}  // namespace mray::fuzz
