// The answers to all questions about a scene's triangles, to be compared bit by bit.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/backend.h"
#include "common/scene_queries.h"
#include "tests/support/test_scene.h"

namespace mray::test {

/// Answers a batch: cpu::TreeQueries, cpu::BruteTracer or a backend.
using Queries = std::function<void(const QueryBatch&)>;

inline Queries queries_of(Backend& backend) {
    return [&backend](const QueryBatch& batch) { backend.query(batch); };
}

/// Rays, each with a cursor, and points.
struct Questions {
    std::vector<Ray> rays;
    std::vector<HitCursor> after;
    std::vector<vec3> points;
    /// The squared distance up to which Answers::near are found: a part of the scene.
    float reach = 0x1p+34f;
    /// What they see; without `sees` everything.
    TriangleFilter filter = {};

    const TriangleFilter* filter_or_null() const { return filter.sees ? &filter : nullptr; }
};

/// Questions on which answers fail; cursors are at hits that `reference` finds, or before all.
Questions mixed_questions(const TestScene& scene, const Queries& reference, Crossing crossing,
                          std::size_t count, std::uint64_t seed);

struct Answers {
    std::vector<std::uint64_t> counts;
    HitLists lists;
    std::vector<Hit> next;
    std::vector<FloatWinding> windings;
    /// Ascending.
    std::vector<UncertainCrossing> uncertain;
    std::vector<ClosestTriangle> closest;
    std::vector<ClosestTriangle> near;
    /// Without a filter none, since a device itself does not know them.
    std::vector<NumberedTriangle> exact;
};

/// Lists have at most `most` hits a ray.
Answers answers_of(const Queries& queries, const Questions& questions, Crossing crossing,
                   std::uint32_t most);

/// The lists of each ray.
std::vector<std::span<const Hit>> lists_of_rays(const HitLists& lists);

enum class Answered { kCounts, kLists, kNextHits, kWindings, kClosestPoints };

/// Calls visit(kind, i) where answers about ray or point i differ in a bit.
void visit_differences(const Answers& a, const Answers& b,
                       const std::function<void(Answered, std::size_t)>& visit);

/// The number of answers that differ.
std::size_t count_differences(const Answers& a, const Answers& b);

}  // namespace mray::test
