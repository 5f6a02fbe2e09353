#include "tests/fuzz/run/replay.h"

#include <fmt/format.h>

#include <cstdio>

#include "common/base/errors.h"
#include "cpu/cpu_backend.h"
#include "tests/fuzz/case/case_text.h"

namespace mray::fuzz {

std::vector<NamedCase> read_cases(const std::vector<std::string>& files) {
    std::vector<NamedCase> cases;
    for (const std::string& file : files) {
        cases.push_back({file, read_case_file(file)});
        // Refuse invalid cases before workers start.
        try {
            const FuzzScene scene(cases.back().fuzz_case);
        } catch (const Error& error) {
            throw Error(error.kind(), fmt::format("{}: {}", file, error.what()));
        }
    }
    return cases;
}

int run_replay(const std::vector<NamedCase>& cases, const Worker& worker, WorkerState& state,
               std::atomic<std::uint64_t>& failures) {
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend({.threads = 1});
    const Variants variants = worker.vulkan ? vulkan_variants() : cpu_variants();
    Referee referee(*brute);
    for (const NamedCase& named : cases) {
        ++state.current;
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
