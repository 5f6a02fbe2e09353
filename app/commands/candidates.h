// The triangles that a ray may hit, with the result of every condition of the hit rule.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace mray::app {

struct Candidate {
    std::uint32_t prim_id = 0;
    /// Edge functions of the projected vertices; inside the triangle all have one sign.
    float edge_u = 0;
    float edge_v = 0;
    float edge_w = 0;
    float t = 0;
    float u = 0;
    float v = 0;
    /// The least depth of hits in the triangle's own box (least_depth in common/interop/slab.h).
    float t_least = 0;

    bool may_hit = false;   // the fast filter keeps it
    bool inside = false;    // no two edges of opposite signs
    bool has_area = false;  // its vertices are not collinear
    bool in_range = false;  // 0 < t, tnear <= t <= tfar
    bool finite = false;
    bool meets_box = false;  // its own box, with a t_least up to last_depth of t
    bool is_hit = false;     // the result of the rule

    bool operator==(const Candidate&) const = default;
};

/// Tests all triangles (positions in scene space) by brute force. Returns the hits from the nearest
/// to the farthest, so that the first is the answer, then triangles that the fast filter keeps; at
/// most `limit` triangles, and in addition those of `wanted`.
std::vector<Candidate> find_candidates(const Ray& ray, const Topology& topology,
                                       std::span<const vec3> positions, std::size_t limit,
                                       std::span<const std::uint32_t> wanted);

}  // namespace mray::app
