#include "lab/bench/embree/embree_peers.h"

#include <fmt/format.h>

#include <memory>

#include "lab/bench/embree/embree_tracer.h"

namespace mray::bench {

EmbreeScenes::EmbreeScenes(std::span<const EmbreeDevice> devices, const BenchScene& scene)
    : mesh_(scene.topology(), scene.positions) {
    for (const EmbreeDevice& device : devices) {
        const auto add = [&](EmbreeTree tree, const char* name) {
            for (const bool robust : {false, true}) {
                variants_.push_back({EmbreeScene(device, mesh_, tree, robust), robust,
                                     fmt::format("{}, {}", name, device.isa())});
            }
        };
        add(EmbreeTree::kMedium, "MEDIUM");
        add(EmbreeTree::kHigh, "HIGH");
    }
}

std::vector<Peer> embree_peers(const EmbreeScenes& scenes, const TraceWork& work) {
    std::vector<Peer> peers;
    for (const EmbreeWay& way : embree_ways(work.kind)) {
        const std::shared_ptr<EmbreeTracer> tracer = way.make(work);
        for (const EmbreeScenes::Variant& variant : scenes.variants()) {
            const EmbreeScene& scene = variant.scene;
            peers.push_back(
                {.name = fmt::format("Embree {} {} ({})", way.name,
                                     variant.robust ? "robust" : "fast", variant.name),
                 .group = fmt::format("embree {} {}", way.one_ray, variant.robust),
                 .one_ray = way.one_ray,
                 .trace = [tracer, &scene](const WorkPart& part) { tracer->trace(scene, part); },
                 .answers = [tracer] { return tracer->answers(); }});
        }
    }
    return peers;
}

}  // namespace mray::bench
