// Every ray against every triangle.
#pragma once

#include <span>
#include <variant>

#include "common/interop/ray.h"
#include "common/scene/mesh.h"
#include "common/scene_queries.h"

namespace mray::cpu {

/// Finds hits and answers queries over a mesh in scene space that outlives it. Threads share it.
class BruteTracer {
public:
    BruteTracer(const Topology& topology, std::span<const vec3> positions)
        : topology_(&topology), positions_(positions) {}

    Hit intersect(const Ray& ray) const;
    bool occluded(const Ray& ray) const;
    void operator()(const QueryBatch& batch) const {
        std::visit([this](const auto& query) { answer(query); }, batch);
    }

private:
    void answer(const CountQuery& query) const;
    void answer(const ListQuery& query) const;
    void answer(const NextQuery& query) const;
    void answer(const WindingQuery& query) const;
    void answer(const ClosestQuery& query) const;

    const Topology* topology_;
    std::span<const vec3> positions_;
};

}  // namespace mray::cpu
