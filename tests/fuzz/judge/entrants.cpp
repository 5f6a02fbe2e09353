#include "tests/fuzz/judge/entrants.h"

#include <fmt/format.h>

#include "common/base/errors.h"
#include "common/simd/simd_target.h"
#include "cpu/cpu_backend.h"
#ifdef MORPHRAY_HAS_VULKAN
#include "gpu/vulkan_backend_internal.h"
#endif

namespace morphray::fuzz {
namespace {

std::vector<std::string> simd_names() {
    std::vector<std::string> names;
    for (const SimdTarget& target : supported_simd_targets()) names.emplace_back(target.name);
    names.emplace_back(cpu::kSimdOff);
    return names;
}

}  // namespace

const char* name_of(TreeKind tree) {
    switch (tree) {
        case TreeKind::kRefitted:
            return "refitted";
        case TreeKind::kRebuilt:
            return "rebuilt";
        case TreeKind::kAuto:
            break;
    }
    return "auto";
}

std::string Entrant::name() const { return fmt::format("{}, {} tree", tracer, name_of(tree)); }

Entrants cpu_entrants() {
    Entrants entrants;
    entrants.lineups.resize(2);
    const auto add = [&](const std::string& simd, int threads, TreeKind tree, std::size_t lineup) {
        entrants.backends.push_back(cpu::make_cpu_backend({.threads = threads, .simd = simd}));
        Entrant entrant;
        entrant.backend = entrants.backends.back().get();
        entrant.tracer = fmt::format("cpu {}, {}", simd, threads == 1 ? "1 thread" : "2 threads");
        entrant.tree = tree;
        entrant.arguments = fmt::format("--backend cpu --simd {} --threads {}", simd, threads);
        entrants.lineups[lineup].push_back(entrant);
    };
    int turn = 0;
    for (const std::string& simd : simd_names()) {
        for (const std::size_t lineup : {0, 1}) {
            const int threads = lineup == 0 ? 1 : 2;
            add(simd, threads, TreeKind::kRefitted, lineup);
            add(simd, 3 - threads, TreeKind::kRebuilt, lineup);
        }
        // Costs more than the others: half of them in each line-up.
        add(simd, 1, TreeKind::kAuto, static_cast<std::size_t>(turn++ % 2));
    }
    return entrants;
}

#ifdef MORPHRAY_HAS_VULKAN
Entrants vulkan_entrants() {
    // Rays are suspended and continued a few times, but not at every step: that takes long.
    constexpr std::uint32_t kShortBudget = 24;
    Entrants entrants;
    // Making one takes seconds: kernels are compiled.
    entrants.backends.push_back(gpu::make_vulkan_backend());
    gpu::Tuning tuning;
    tuning.most_packet_lanes = 4;
    tuning.step_budget = kShortBudget;
    entrants.backends.push_back(gpu::make_vulkan_backend({}, tuning));
    Backend* const device = entrants.backends[0].get();
    Backend* const tuned = entrants.backends[1].get();
    const char* const arguments = "--backend vulkan";
    const Entrant refitted{device, "vulkan", TreeKind::kRefitted, arguments};
    const Entrant rebuilt{device, "vulkan", TreeKind::kRebuilt, arguments};
    const Entrant kept{device, "vulkan", TreeKind::kAuto, arguments};
    const Entrant narrow{tuned, "vulkan with narrow packets", TreeKind::kRefitted, {}};
    entrants.lineups = {{refitted, rebuilt, narrow}, {refitted, kept, narrow}};
    return entrants;
}
#else
Entrants vulkan_entrants() {
    throw Error(ErrorKind::kUnavailable,
                "Vulkan: not built in; use --backend cpu, or build with -DMORPHRAY_VULKAN=ON");
}
#endif

}  // namespace morphray::fuzz
