#include <fmt/format.h>

#include "common/base/errors.h"
#include "common/simd/simd_target.h"
#include "cpu/cpu_backend.h"
#include "tests/fuzz/judge/judge.h"
#ifdef MORPHRAY_HAS_VULKAN
#include "gpu/shared_device.h"
#endif

namespace mray::fuzz {
namespace {

std::vector<std::string> simd_names() {
    std::vector<std::string> names;
    for (const SimdTarget& target : supported_simd_targets()) names.emplace_back(target.name);
    names.emplace_back(kSimdOff);
    return names;
}

}  // namespace

const char* name_of(TreeKind tree) {
    if (tree == TreeKind::kAuto) return "auto";
    return tree == TreeKind::kRebuilt ? "rebuilt" : "refitted";
}

std::string Variant::name() const { return fmt::format("{}, {} tree", tracer, name_of(tree)); }

Variants cpu_variants() {
    Variants variants;
    variants.groups.resize(2);
    const auto add = [&](const std::string& simd, int threads, TreeKind tree, std::size_t group) {
        variants.backends.push_back(cpu::make_cpu_backend({.threads = threads, .simd = simd}));
        Variant variant;
        variant.backend = variants.backends.back().get();
        variant.tracer = fmt::format("cpu {}, {}", simd, threads == 1 ? "1 thread" : "2 threads");
        variant.tree = tree;
        variants.groups[group].push_back(variant);
    };
    int turn = 0;
    for (const std::string& simd : simd_names()) {
        for (const std::size_t group : {0, 1}) {
            const int threads = group == 0 ? 1 : 2;
            add(simd, threads, TreeKind::kRefitted, group);
            add(simd, 3 - threads, TreeKind::kRebuilt, group);
        }
        // These cost more than the others, so each group has half of them.
        add(simd, 1, TreeKind::kAuto, static_cast<std::size_t>(turn++ % 2));
    }
    return variants;
}

#ifdef MORPHRAY_HAS_VULKAN
Variants vulkan_variants() {
    // Suspends and resumes rays a few times; doing so at every step would take long.
    constexpr std::uint32_t kShortBudget = 24;
    Variants variants;
    // Making a backend takes seconds, because kernels are compiled.
    variants.backends.push_back(gpu::make_vulkan_backend());
    gpu::Tuning tuning;
    tuning.step_budget = kShortBudget;
    variants.backends.push_back(gpu::make_vulkan_backend({}, tuning));
    Backend* const device = variants.backends[0].get();
    Backend* const tuned = variants.backends[1].get();
    const Variant refitted{device, "vulkan", TreeKind::kRefitted};
    const Variant rebuilt{device, "vulkan", TreeKind::kRebuilt};
    const Variant kept{device, "vulkan", TreeKind::kAuto};
    const Variant suspended{tuned, "vulkan with a short budget", TreeKind::kRefitted};
    variants.groups = {{refitted, rebuilt, suspended}, {refitted, kept, suspended}};
    return variants;
}
#else
Variants vulkan_variants() {
    throw Error(ErrorKind::kUnavailable,
                "Vulkan: not built in; use --backend cpu, or build with -DMORPHRAY_VULKAN=ON");
}
#endif

}  // namespace mray::fuzz
