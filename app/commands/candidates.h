// The triangles that a ray may hit, each judged by the hit rule with every condition apart.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace morphray::app {

struct Candidate {
    std::uint32_t prim_id = 0;
    /// Edge functions of the projected vertices; on an inner point all have one sign.
    float edge_u = 0;
    float edge_v = 0;
    float edge_w = 0;
    float t = 0;
    float u = 0;
    float v = 0;
    /// Where the triangle's own dilated box is entered; a hit is never before it.
    float t_enter = 0;

    bool may_hit = false;   // the fast test lets it pass
    bool inside = false;    // no two edges of opposite signs
    bool has_area = false;  // its vertices are not collinear
    bool in_range = false;  // 0 < t, tnear <= t <= tfar
    bool finite = false;
    bool meets_box = false;  // its own box, before or at t
    bool is_hit = false;     // the verdict of the rule

    bool operator==(const Candidate&) const = default;
};

/// Candidates by brute force over all triangles (positions in scene space): first the hits from the
/// nearest to the farthest, so that the first is the answer, then what the fast test does not
/// exclude. At most `limit`, and the triangles of `wanted` besides.
std::vector<Candidate> find_candidates(const Ray& ray, const Topology& topology,
                                       std::span<const vec3> positions, std::size_t limit,
                                       std::span<const std::uint32_t> wanted);

}  // namespace morphray::app
