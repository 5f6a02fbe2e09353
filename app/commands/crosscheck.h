// The queries that `crosscheck` compares, and their references.
#pragma once

#include <array>

#include "app/report/check_report.h"
#include "common/backend.h"

namespace mray::app {

/// True if brute force takes at most 2e9 ray-triangle tests a frame.
bool brute_is_affordable(double triangles, const morphray::View& view, morphray::Rays rays);

/// Rays and points in scene space, as many of the one as of the other.
struct CheckBatch {
    std::vector<Ray> rays;
    std::vector<vec3> points;
};

/// Queries that no machine or run changes, around the mesh, its vertices, edges and triangles.
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
std::vector<QueryDifference> compare_answers(const Answers& expected, const Answers& actual);

}  // namespace mray::app
