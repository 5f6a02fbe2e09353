#include "tests/fuzz/run/replay.h"

#include <fmt/format.h>

#include "common/base/errors.h"
#include "cpu/cpu_backend.h"
#include "tests/fuzz/case/case_text.h"
#include "tests/fuzz/run/campaign.h"

namespace mray::fuzz {

std::vector<NamedCase> read_cases(const std::vector<std::string>& files) {
    std::vector<NamedCase> cases;
    for (const std::string& file : files) {
        cases.push_back({file, read_case_file(file)});
        // Refuse invalid cases before processes start.
        try {
            const FuzzScene scene(cases.back().fuzz_case);
        } catch (const Error& error) {
            throw Error(error.kind(), fmt::format("{}: {}", file, error.what()));
        }
    }
    return cases;
}

int run_replay(const std::vector<NamedCase>& cases, const Process& process) {
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend({.threads = 1});
    const Variants variants = process.vulkan ? vulkan_variants() : cpu_variants();
    Referee referee(*brute);
    Progress progress(process);
    std::uint64_t number = 0;
    for (const auto& [name, fuzz_case] : cases) {
        progress.begin(++number);
        std::vector<std::string> differences;
        for (const auto& group : variants.groups) {
            for (const Finding& finding : check_case(referee, fuzz_case, group, progress.tally))
                differences.push_back(describe(finding));
        }
        for (const std::string& difference : differences)
            fmt::print("{} on {}: {}\n", name, process.name(), difference);
    }
    return progress.finish();
}

}  // namespace mray::fuzz
