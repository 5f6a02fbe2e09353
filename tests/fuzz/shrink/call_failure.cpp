#include "tests/fuzz/shrink/call_failure.h"

#include <fmt/format.h>

#include <cstdio>

#include "common/base/output_file.h"
#include "tests/fuzz/case/case_text.h"

namespace mray::fuzz {
namespace {

const char* word_of(const Call& call) { return kCallWords[static_cast<std::size_t>(call.kind)]; }

}  // namespace

FuzzCase shrink_calls(const FuzzCase& failing, const std::function<bool(const FuzzCase&)>& fails) {
    FuzzCase small = failing;
    const auto keep = [&](FuzzCase&& smaller) {
        if (!fails(smaller)) return false;
        small = std::move(smaller);
        return true;
    };
    for (bool is_smaller = true; is_smaller;) {
        is_smaller = false;
        for (std::size_t length = small.calls.size(); length > 0; length /= 2) {
            for (std::size_t end = small.calls.size(); end >= length && end > 0; --end) {
                if (end > small.calls.size()) continue;
                FuzzCase smaller = small;
                const auto last = smaller.calls.begin() + static_cast<std::ptrdiff_t>(end);
                smaller.calls.erase(last - static_cast<std::ptrdiff_t>(length), last);
                if (!smaller.calls.empty()) is_smaller |= keep(std::move(smaller));
            }
        }
        for (std::size_t i = 0; i < small.calls.size(); ++i) {
            const std::uint32_t number = small.calls[i].number;
            for (const std::uint32_t less : {0u, 1u, number / 2, number - 1}) {
                if (less >= number) continue;
                FuzzCase smaller = small;
                smaller.calls[i].number = less;
                if (!keep(std::move(smaller))) continue;
                is_smaller = true;
                break;
            }
        }
    }
    return small;
}

std::string describe(const CallDifference& difference, const FuzzCase& fuzz_case) {
    const Call& call = fuzz_case.calls[difference.call];
    return fmt::format("call {} ({}, scene {}): {}{}{}", difference.call + 1, word_of(call),
                       call.scene, difference.what, difference.text.empty() ? "" : ", ",
                       difference.text);
}

void report_call_failure(const FailureConfig& config, const FuzzCase& fuzz_case,
                         const CallDifference& difference, const CallDevices& devices,
                         const std::string& name) {
    const auto compare = [&](const FuzzCase& one) { return CallModel(one).compare(devices); };
    if (config.only_list) {
        std::printf("%s | %s | %s\n", name.c_str(), devices.name.c_str(),
                    describe(difference, fuzz_case).c_str());
        std::fflush(stdout);
        return;
    }
    const FuzzCase small = shrink_calls(fuzz_case, [&](const FuzzCase& smaller) {
        const std::optional<CallDifference> found = compare(smaller);
        return found && found->what == difference.what;
    });
    const std::optional<CallDifference> left = compare(small);
    if (!left) {
        std::printf("FAILED %s, but not each time\n%s: %s\n", name.c_str(), devices.name.c_str(),
                    describe(difference, fuzz_case).c_str());
        std::fflush(stdout);
        return;
    }
    const std::string what = fmt::format("{}, {}", devices.name, describe(*left, small));
    const std::filesystem::path path = config.out / name / "case.txt";
    make_output_folder(path.parent_path());
    write_file(path, to_text(small, "failed: " + what));
    std::printf("FAILED %s, shrunk to %zu calls:\n%s\n./fuzz replay %s --backend %s\n\n",
                name.c_str(), small.calls.size(), what.c_str(), path.c_str(),
                devices.name == "vulkan" ? "vulkan" : "cpu");
    std::fflush(stdout);
}

}  // namespace mray::fuzz
