#include "common/simd/simd_target.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/errors.h"
#include "common/simd/simd_dispatch-inl.h"

namespace mray {
namespace {

// Best first.
constexpr SimdTarget kTargets[] = {
    {"avx512", HWY_AVX3}, {"avx2", HWY_AVX2},     {"ssse3", HWY_SSSE3},
    {"neon", HWY_NEON},   {"scalar", HWY_SCALAR},
};

constexpr std::int64_t named_bits() {
    std::int64_t bits = 0;
    for (const SimdTarget& target : kTargets) bits |= target.bit;
    return bits;
}

static_assert((HWY_TARGETS & ~named_bits()) == 0, "a target is compiled that no name leads to");

bool is_supported(const SimdTarget& target) {
    if ((target.bit & HWY_TARGETS) == 0) return false;
    // Asking the processor takes some 40 us on a virtual machine, and Highway asks each time.
    static const std::int64_t supported = hwy::SupportedTargets() | HWY_SCALAR;
    return (target.bit & supported) != 0;
}

}  // namespace

std::vector<SimdTarget> supported_simd_targets() {
    std::vector<SimdTarget> targets;
    std::copy_if(std::begin(kTargets), std::end(kTargets), std::back_inserter(targets),
                 is_supported);
    return targets;
}

std::string names_of(const std::vector<SimdTarget>& targets) {
    std::vector<std::string_view> names;
    std::ranges::transform(targets, std::back_inserter(names), &SimdTarget::name);
    return fmt::format("{}", fmt::join(names, ", "));
}

SimdTarget find_simd_target(std::string_view name) {
    const std::vector<SimdTarget> supported = supported_simd_targets();
    if (name.empty() || name == "best") return supported.front();
    const auto is_it = [name](const SimdTarget& target) { return target.name == name; };
    const auto found = std::find_if(supported.begin(), supported.end(), is_it);
    if (found != supported.end()) return *found;
    const bool known = std::any_of(std::begin(kTargets), std::end(kTargets), is_it);
    throw Error(known ? ErrorKind::kUnavailable : ErrorKind::kBadArgument,
                fmt::format("SIMD target '{}' {}; there are {}", name,
                            known ? "is not available on this machine" : "is unknown",
                            names_of(supported)));
}

const SimdTarget& best_simd_target() {
    static const SimdTarget best = supported_simd_targets().front();
    return best;
}

void check_simd(std::string_view name) {
    if (name != kSimdOff) find_simd_target(name);
}

}  // namespace mray
