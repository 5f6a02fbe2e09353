#include "lab/bench/embree/embree_peers.h"

#include <fmt/format.h>

#include <memory>

#include "lab/bench/embree/embree_tracer.h"

namespace mray::bench {
namespace {

/// "Embree Intersect16 fast", "Embree Intersect1 robust", "Embree Occluded16 fast from memory"
std::string name_of(const EmbreeWay& way, bool robust) {
    return fmt::format("Embree {} {}{}", way.name, robust ? "robust" : "fast",
                       way.source == RecordSource::kMemory ? " from memory" : "");
}

std::string group_of(const EmbreeWay& way, bool robust) {
    return fmt::format("embree {} {} {}", way.one_ray, robust, way.source == RecordSource::kMemory);
}

}  // namespace

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
        const bool in_memory = way.source == RecordSource::kMemory;
        // Records that are made within the time may be those of another scene.
        std::shared_ptr<EmbreeTracer> tracer;
        for (const EmbreeScenes::Variant& variant : scenes.variants()) {
            if (in_memory && variant.robust) continue;
            if (in_memory || !tracer) tracer = way.make(work);
            const EmbreeScene& scene = variant.scene;
            peers.push_back(
                {.name = fmt::format("{} ({})", name_of(way, variant.robust), variant.name),
                 .group = group_of(way, variant.robust),
                 .one_ray = way.one_ray,
                 .prepare = [tracer] { tracer->reset(); },
                 .trace = [tracer, &scene](const WorkPart& part) { tracer->trace(scene, part); },
                 .answers = [tracer] { return tracer->answers(); }});
        }
    }
    return peers;
}

}  // namespace mray::bench
