#include <memory>

#include "lab/accuracy/methods/method.h"
#include "lab/accuracy/methods/plain_traversal.h"
#include "lab/accuracy/methods/quantised_nodes.h"
#include "lab/accuracy/methods/rules.h"

namespace mray::accuracy {
namespace {

Method method(const char* name, TraceBatch trace) {
    Method result;
    result.name = name;
    result.family = Family::kRule;
    result.in_scene_space = true;
    result.trace = std::move(trace);
    return result;
}

template <class Slabs>
Method over_nodes(const char* name, const Bvh& bvh) {
    return method(name, [&bvh](std::span<const Ray> rays, std::span<Hit> hits) {
        trace_all_plainly<OurRule, Slabs>(bvh, rays, hits);
    });
}

template <std::unsigned_integral Grid>
Method over_quantised(const char* name, const Bvh& bvh) {
    const auto nodes =
        std::make_shared<const std::vector<QuantisedNode<Grid>>>(quantised_nodes<Grid>(bvh));
    return method(name, [nodes, &bvh](std::span<const Ray> rays, std::span<Hit> hits) {
        for (std::size_t i = 0; i < rays.size(); ++i)
            hits[i] = trace_plainly<OurRule, QuantisedSlabs>(*nodes, bvh.leaves, rays[i]);
    });
}

}  // namespace

std::vector<Method> box_methods(const ChartScene& scene) {
    const Bvh& bvh = scene.scene_space.bvh;
    return {over_nodes<DilatedSlabs>("boxes: ours", bvh),
            over_nodes<PaddedSlabs>("boxes: 2 ulp", bvh),
            over_nodes<PlainSlabs>("boxes: plain", bvh),
            over_quantised<std::uint16_t>("nodes: 16 bit", bvh),
            over_quantised<std::uint8_t>("nodes: 8 bit", bvh)};
}

}  // namespace mray::accuracy
