#include "lab/accuracy/methods/method.h"
#include "lab/accuracy/methods/plain_traversal.h"
#include "lab/accuracy/methods/rules.h"

namespace mray::accuracy {
namespace {

using TraceAll = void (*)(const Bvh&, std::span<const Ray>, std::span<Hit>);

Method method(const char* name, const ChartScene& scene, bool in_scene_space, TraceAll trace_all) {
    Method result;
    result.name = name;
    result.in_scene_space = in_scene_space;
    const Bvh& bvh = result.space(scene).bvh;
    result.trace = [&bvh, trace_all](std::span<const Ray> rays, std::span<Hit> hits) {
        trace_all(bvh, rays, hits);
    };
    return result;
}

}  // namespace

std::vector<Method> rule_methods(const ChartScene& scene) {
    return {method("rule: ours", scene, true, trace_all_plainly<OurRule, DilatedSlabs>),
            method("rule: Moeller-Trumbore", scene, false,
                   trace_all_plainly<MoellerTrumbore, PaddedSlabs>),
            method("rule: Woop", scene, false, trace_all_plainly<WoopWatertight, PaddedSlabs>),
            method("rule: b x c", scene, false, trace_all_plainly<EdgePlanes, PaddedSlabs>),
            method("boxes: 2 ulp", scene, true, trace_all_plainly<OurRule, PaddedSlabs>),
            method("boxes: plain", scene, true, trace_all_plainly<OurRule, PlainSlabs>)};
}

}  // namespace mray::accuracy
