// The hit rule: which triangles a ray hits and which of them wins. One text for every backend.
//
// With a, b, c the vertices relative to the origin, the three edge functions are
//     U = dir . ((b - c) x (b + c)),  V = dir . ((c - a) x (c + a)),  W = dir . ((a - b) x (a +
//     b)),
// each twice the volume spanned by dir and one edge. Exchanging the two vertices of an edge negates
// its function bit for bit, so two triangles that share an edge can never both lose a ray on it.
// The sum-difference form keeps the error proportional to the edge, where b x c would lose it to
// the distance (after W. Kahan's cross product of nearly parallel vectors; S. Woop, C. Benthin, I.
// Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013, has the same goal by other means).
// Depth is compared as 1/t = dir . N / (N . a), so there is no division; the larger wins, and equal
// depths go to the smaller prim_id.
//
// A candidate counts only if the ray also meets the triangle's own dilated box, and not noticeably
// before entering it. Rounding accepts nearly degenerate triangles far outside their box; a tree
// would find those for some rays and not for others. With the two conditions the answer depends on
// the ray and the set of triangles alone.
#ifndef COMMON_INTEROP_TRIANGLE_H
#define COMMON_INTEROP_TRIANGLE_H

#include "common/interop/slab.h"

SHARED_BEGIN

/// The edge functions (up to a common positive factor the barycentric weights) and 1/t.
struct Candidate {
    float u;
    float v;
    float w;
    float inv_t;
};

/// Whether the ray passes inside the three edges in front of its origin, within [tnear, tfar]. The
/// vertices a, b, c are in scene space. Triangles without area, and origins in the triangle's
/// plane, give false.
SHARED bool intersect_edges(Ray ray, vec3 a, vec3 b, vec3 c, OUT(Candidate) candidate) {
    PRECISE vec3 ra = a - ray.org;
    PRECISE vec3 rb = b - ray.org;
    PRECISE vec3 rc = c - ray.org;
    PRECISE vec3 bmc = rb - rc;
    PRECISE vec3 bpc = rb + rc;
    PRECISE vec3 cma = rc - ra;
    PRECISE vec3 cpa = rc + ra;
    PRECISE vec3 amb = ra - rb;
    PRECISE vec3 apb = ra + rb;
    PRECISE float u = dot3(ray.dir, cross3(bmc, bpc));
    PRECISE float v = dot3(ray.dir, cross3(cma, cpa));
    PRECISE float w = dot3(ray.dir, cross3(amb, apb));
    PRECISE vec3 bma = rb - ra;
    PRECISE vec3 normal = cross3(bma, cma);
    PRECISE float volume = dot3(normal, ra);
    bool flip = volume < 0.0f;
    u = flip ? -u : u;
    v = flip ? -v : v;
    w = flip ? -w : w;
    PRECISE float scale = rcp(volume);
    PRECISE vec3 scaled = vec3(normal.x * scale, normal.y * scale, normal.z * scale);
    PRECISE float inv_t = dot3(ray.dir, scaled);
    PRECISE float sum = (u + v) + w;
    PRECISE float at_tnear = inv_t * ray.tnear;
    PRECISE float at_tfar = inv_t * ray.tfar;
    candidate.u = u;
    candidate.v = v;
    candidate.w = w;
    candidate.inv_t = inv_t;
    return volume != 0.0f && u >= 0.0f && v >= 0.0f && w >= 0.0f && sum > 0.0f &&
           inv_t > kMinInvT && inv_t < kMaxInvT && at_tnear <= 1.0f && at_tfar >= 1.0f;
}

/// The second half of the rule: the triangle's own dilated box, and no vertex that is not finite.
SHARED bool within_own_box(SlabRay s, vec3 a, vec3 b, vec3 c, float inv_t) {
    vec3 lower = vec3(min(a.x, min(b.x, c.x)), min(a.y, min(b.y, c.y)), min(a.z, min(b.z, c.z)));
    vec3 upper = vec3(max(a.x, max(b.x, c.x)), max(a.y, max(b.y, c.y)), max(a.z, max(b.z, c.z)));
    float t_enter;
    bool meets = hits_box(s, lower, upper, t_enter);
    return meets && upper.x <= kSceneExtent && !beyond(t_enter, inv_t);
}

/// Whether a candidate on prim_id beats the best so far (best_prim == kNoPrim: none yet, with
/// best_inv_t the bound that any candidate must exceed or meet).
SHARED bool wins(float inv_t, uint prim_id, float best_inv_t, uint best_prim) {
    return inv_t > best_inv_t || (inv_t == best_inv_t && prim_id < best_prim);
}

/// A value of 1/t below that of every candidate of the ray: what `beyond` may cull by before the
/// first hit.
SHARED float first_bound(Ray ray) {
    // at_tfar >= 1 after one rounding means inv_t >= (1 - 2^-24) / tfar, rcp is within 1 ulp of
    // 1/tfar, and 1 - 2^-20 covers both. Below 2^-90 the bound would be of no use.
    PRECISE float r = rcp(ray.tfar);
    PRECISE float bound = r * 0.99999904632568359375f;
    return ray.tfar < 1.2379400392853803e+27f && ray.tfar > 8.077935669463161e-28f ? bound : 0.0f;
}

/// t, u, v of the winner.
SHARED Hit finish_hit(Candidate candidate, uint prim_id) {
    PRECISE float sum = (candidate.u + candidate.v) + candidate.w;
    PRECISE float scale = rcp(sum);
    PRECISE float u = candidate.v * scale;
    PRECISE float v = candidate.w * scale;
    Hit h;
    h.t = rcp(candidate.inv_t);
    h.u = u;
    h.v = v;
    h.prim_id = prim_id;
    return h;
}

SHARED_END

#endif  // COMMON_INTEROP_TRIANGLE_H
