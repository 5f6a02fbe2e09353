// Queries about all triangles of a scene, and how the answers of backends differ.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "app/report/crosscheck/check_report.h"
#include "common/backend.h"
#include "common/scene/mesh.h"
#include "common/scene_queries.h"

namespace mray::app {

/// Rays and points in scene space, as many of the one as of the other.
struct CheckBatch {
    std::vector<Ray> rays;
    std::vector<vec3> points;
};

/// The same queries on every machine, around the mesh, its vertices, edges and triangles.
CheckBatch pseudo_random_batch(const Topology& topology, std::span<const vec3> positions,
                               std::uint32_t count);

struct Answers {
    /// For Crossing::kEach and kOwner.
    std::array<HitLists, 2> hits;
    std::vector<FloatWinding> windings;
    /// Ascending.
    std::vector<UncertainCrossing> uncertain;
    std::vector<ClosestTriangle> closest;
};

Answers answers_of(Backend& backend, const CheckBatch& batch);

/// Counts the rays and points with other answers, bit by bit.
QueryDifference compare_answers(const Answers& expected, const Answers& actual);

}  // namespace mray::app
