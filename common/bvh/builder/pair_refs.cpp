#include "common/bvh/builder/pair_refs.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <vector>

namespace mray {
namespace {

/// True if exactly two vertices of b are vertices of a.
bool share_an_edge(const uvec3& a, const uvec3& b) {
    const auto in_a = [&](std::uint32_t v) { return v == a.x || v == a.y || v == a.z ? 1 : 0; };
    return in_a(b.x) + in_a(b.y) + in_a(b.z) == 2;
}

// The largest area of a pair's box, as a part of the sum of the areas of both boxes. A smaller part
// makes fewer pairs, a larger one trees that cost up to 4 % more (lab/notes/build_and_refit.md).
constexpr float kPairArea = 0.75f;

// Triangles of a task, whatever the number of threads.
constexpr std::size_t kPairingTask = 2048;

}  // namespace

std::size_t pair_refs(const Topology& topology, std::span<PrimRef> refs) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < refs.size(); ++i) {
        PrimRef ref = refs[i];
        if (i + 1 < refs.size() && share_an_edge(topology.triangles[ref.prim_id()],
                                                 topology.triangles[refs[i + 1].prim_id()])) {
            const PrimRef& next = refs[i + 1];
            PrimRef pair;
            for (int k = 0; k < 8; ++k) pair.planes[k] = std::min(ref.planes[k], next.planes[k]);
            pair.set_area();
            if (pair.area() <= kPairArea * (ref.area() + next.area())) {
                pair.make_pair_of(ref.prim_id());
                ref = pair;
                ++i;
            }
        }
        refs[count++] = ref;
    }
    return count;
}

std::span<PrimRef> make_paired_refs(const Topology& topology, std::span<const vec3> positions,
                                    PrimRef* first, PrimRef* second, const SimdTarget& target,
                                    const Watch& watch) {
    const std::size_t triangles = topology.triangles.size();
    // Where the refs of each task begin, once all are known.
    std::vector<std::size_t> place((triangles + kPairingTask - 1) / kPairingTask + 1, 0);
    const auto for_each_task = [&](auto step) {
        tbb::parallel_for(std::size_t{0}, place.size() - 1, [&](std::size_t i) {
            watch.throw_if_cancelled();
            step(i, i * kPairingTask);
        });
    };
    for_each_task([&](std::size_t i, std::size_t begin) {
        const std::span refs(first + begin, std::min(kPairingTask, triangles - begin));
        make_refs(topology, positions, static_cast<std::uint32_t>(begin), refs, target);
        place[i + 1] = pair_refs(topology, refs);
    });
    for (std::size_t i = 1; i < place.size(); ++i) place[i] += place[i - 1];
    if (place.back() == triangles) return {first, triangles};
    for_each_task([&](std::size_t i, std::size_t begin) {
        std::copy_n(first + begin, place[i + 1] - place[i], second + place[i]);
    });
    return {second, place.back()};
}

void open_pairs(const Topology& topology, std::span<const vec3> positions, PrimRef* refs,
                std::size_t count, std::size_t triangles, const SimdTarget& target) {
    PrimRef* to = refs + triangles;
    while (count-- > 0) {
        const PrimRef ref = refs[count];
        const std::span own(to -= ref.triangle_count(), ref.triangle_count());
        make_refs(topology, positions, ref.prim_id(), own, target);
    }
}

}  // namespace mray
