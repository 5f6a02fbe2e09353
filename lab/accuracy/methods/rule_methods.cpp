#include "lab/accuracy/methods/method.h"
#include "lab/accuracy/methods/plain_traversal.h"
#include "lab/accuracy/methods/rules.h"

namespace mray::accuracy {
namespace {

using TraceAll = void (*)(const Bvh&, std::span<const Ray>, std::span<Hit>);

// Only these functions may use instructions that the oldest machines lack; the compiler inlines
// everything that they call.
#if defined(__x86_64__) || defined(__i386__)
#define MORPHRAY_WITH_FMA [[gnu::target("fma"), gnu::flatten]]
bool machine_has_fma() { return __builtin_cpu_supports("fma") != 0; }
#else
#define MORPHRAY_WITH_FMA [[gnu::flatten]]
bool machine_has_fma() { return true; }
#endif

MORPHRAY_WITH_FMA void moeller_trumbore_fused(const Bvh& bvh, std::span<const Ray> rays,
                                              std::span<Hit> hits) {
    trace_all_plainly<MoellerTrumbore<true>, PaddedSlabs>(bvh, rays, hits);
}
MORPHRAY_WITH_FMA void woop_fused(const Bvh& bvh, std::span<const Ray> rays, std::span<Hit> hits) {
    trace_all_plainly<WoopWatertight<true>, PaddedSlabs>(bvh, rays, hits);
}
MORPHRAY_WITH_FMA void edge_planes_fused(const Bvh& bvh, std::span<const Ray> rays,
                                         std::span<Hit> hits) {
    trace_all_plainly<EdgePlanes<true>, PaddedSlabs>(bvh, rays, hits);
}
#undef MORPHRAY_WITH_FMA

Method method(const char* name, const ChartScene& scene, bool in_scene_space, TraceAll trace_all) {
    Method result;
    result.name = name;
    result.family = Family::kRule;
    result.in_scene_space = in_scene_space;
    const Bvh& bvh = result.space(scene).bvh;
    result.trace = [&bvh, trace_all](std::span<const Ray> rays, std::span<Hit> hits) {
        trace_all(bvh, rays, hits);
    };
    return result;
}

}  // namespace

std::vector<Method> rule_methods(const ChartScene& scene) {
    std::vector<Method> methods{
        method("rule: ours", scene, true, trace_all_plainly<OurRule, DilatedSlabs>),
        method("rule: Moeller-Trumbore", scene, false,
               trace_all_plainly<MoellerTrumbore<false>, PaddedSlabs>),
        method("rule: Woop", scene, false, trace_all_plainly<WoopWatertight<false>, PaddedSlabs>),
        method("rule: b x c", scene, false, trace_all_plainly<EdgePlanes<false>, PaddedSlabs>)};
    if (machine_has_fma()) {
        methods.push_back(
            method("rule: Moeller-Trumbore fma", scene, false, moeller_trumbore_fused));
        methods.push_back(method("rule: Woop fma", scene, false, woop_fused));
        methods.push_back(method("rule: b x c fma", scene, false, edge_planes_fused));
    }
    return methods;
}

std::vector<Method> box_methods(const ChartScene& scene) {
    return {method("boxes: ours", scene, true, trace_all_plainly<OurRule, DilatedSlabs>),
            method("boxes: 2 ulp", scene, true, trace_all_plainly<OurRule, PaddedSlabs>),
            method("boxes: plain", scene, true, trace_all_plainly<OurRule, PlainSlabs>)};
}

}  // namespace mray::accuracy
