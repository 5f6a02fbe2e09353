#include "tests/fuzz/judge/call_check.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/errors.h"
#include "common/simd/simd_target.h"

namespace mray::fuzz {
namespace {

using morphray::Device;

/// Describes the first part that differs; nothing if all are equal.
std::optional<CallDifference> find_difference(const CallAnswer& expected,
                                              const CallAnswer& actual) {
    for (std::size_t i = 0; i < std::max(expected.size(), actual.size()); ++i) {
        const CallPart none{"nothing", {}};
        const CallPart& a = i < expected.size() ? expected[i] : none;
        const CallPart& b = i < actual.size() ? actual[i] : none;
        if (std::string_view(a.what) != b.what)
            return CallDifference{0, 0, fmt::format("{} instead of {}", b.what, a.what), ""};
        if (a.bits.size() != b.bits.size())
            return CallDifference{
                0, 0, a.what, fmt::format("{} numbers, expected {}", b.bits.size(), a.bits.size())};
        const auto at = std::mismatch(a.bits.begin(), a.bits.end(), b.bits.begin());
        if (at.first == a.bits.end()) continue;
        return CallDifference{
            0, 0, a.what,
            fmt::format("number {} of {}: {:#x}, expected {:#x}", at.first - a.bits.begin(),
                        a.bits.size(), *at.second, *at.first)};
    }
    return std::nullopt;
}

}  // namespace

std::vector<std::vector<CallDevices>> cpu_call_devices() {
    std::vector<std::string> names = morphray::simd_targets();
    names.emplace_back(kSimdOff);
    const Device other = Device::cpu({.threads = 1});
    const Device brute = Device::brute_force({.threads = 1});
    std::vector<std::vector<CallDevices>> groups(2);
    int threads = 1;
    for (const std::string& simd : names) {
        for (auto& group : groups) {
            group.push_back(
                {fmt::format("cpu {}, {}", simd, threads == 1 ? "1 thread" : "2 threads"),
                 {Device::cpu({.threads = threads, .simd = simd}), other, brute}});
            threads = 3 - threads;
        }
        threads = 3 - threads;
    }
    return groups;
}

std::vector<std::vector<CallDevices>> vulkan_call_devices() {
    try {
        return {{{"vulkan",
                  {Device::vulkan(), Device::cpu({.threads = 1}),
                   Device::brute_force({.threads = 1})}}}};
    } catch (const morphray::Error& error) {
        throw Error(ErrorKind::kUnavailable, error.what());
    }
}

std::string describe(const CallDifference& difference, const FuzzCase& fuzz_case) {
    const Call& call = fuzz_case.calls[difference.call];
    return fmt::format("call {} ({}, scene {}): {}, {}", difference.call + 1,
                       kCallWords[static_cast<std::size_t>(call.kind)], call.scene, difference.what,
                       difference.text);
}

CallModel::CallModel(const FuzzCase& fuzz_case) : fuzz_case_(fuzz_case) {
    CallPlay play({});
    for (const Call& call : fuzz_case.calls) answers_.push_back(play.play(call));
}

std::optional<CallDifference> CallModel::compare(const CallDevices& devices) const {
    CallPlay play(devices.devices);
    std::optional<CallDifference> first;
    for (std::size_t i = 0; i < answers_.size(); ++i) {
        std::optional<CallDifference> found =
            find_difference(answers_[i], play.play(fuzz_case_.calls[i]));
        if (!found) continue;
        if (!first) {
            first = std::move(found);
            first->call = i;
        }
        ++first->count;
    }
    return first;
}

std::size_t CallModel::question_count() const {
    std::size_t count = 0;
    for (const Call& call : fuzz_case_.calls)
        count += call.kind >= CallKind::kRays ? call.number : 0;
    return count;
}

}  // namespace mray::fuzz
