// The slab test of a ray against a box dilated by D = kBoxDilation * E, with
// E = max(kSceneExtent, |org|).
//
// Conservative: a ray passes the box of a triangle that it hits within rounding, which is less than
// D. So it always meets the dilated box, and enters it before t + M of the hit: t itself is less
// accurate than the ray's way past the box, by the depth margin M = kDepthMargin * E.
//
// Monotone: every plane goes through one subtraction of a per-ray constant and one multiplication
// by a per-ray constant, and rounding is monotone. So if a box is inside another, its interval is
// inside the other's, bit for bit; a tree of boxes gives the answers of the triangles' own boxes,
// and a box with t_enter > t + M of the closest hit so far holds no closer one
// (docs/design/arithmetic.md, "Boxes").
#if !defined(COMMON_INTEROP_SLAB_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_SLAB_H
#define COMMON_INTEROP_SLAB_H

#include "common/interop/arithmetic.h"
#include "common/interop/ray.h"

#endif

SHARED_BEGIN

/// A ray as the slab test takes it. Lower planes are taken relative to org + D, upper planes
/// relative to org - D, which dilates the box by D.
struct SlabRay {
    Float3 rdir;
    Float3 org_lower;
    Float3 org_upper;
    Float depth_margin;
};

SHARED Float slab_reciprocal(Float d) {
    Bool is_zero = d == 0.0f;
    return select(is_zero, kHugeReciprocal, rcp(select(is_zero, 1.0f, d)));
}

/// E: the size of coordinates that a ray from org has to do with.
SHARED Float extent_of_rays(Float3 org) { return greater(largest_component(org), kSceneExtent); }

/// D for rays from org.
/// Checked: proofs/boxes.g.
SHARED Float box_dilation(Float3 org) {
    PRECISE Float d = kBoxDilation * extent_of_rays(org);
    return d;
}

/// M for rays from org.
/// Checked: proofs/boxes.g.
SHARED Float depth_margin(Float3 org) {
    PRECISE Float m = kDepthMargin * extent_of_rays(org);
    return m;
}

SHARED SlabRay slab_ray(Float3 org, Float3 dir) {
    Float d = box_dilation(org);
    SlabRay s;
    s.rdir = Float3(slab_reciprocal(dir.x), slab_reciprocal(dir.y), slab_reciprocal(dir.z));
    PRECISE Float3 below = Float3(org.x + d, org.y + d, org.z + d);
    PRECISE Float3 above = Float3(org.x - d, org.y - d, org.z - d);
    s.org_lower = below;
    s.org_upper = above;
    s.depth_margin = depth_margin(org);
    return s;
}

/// Boxes that the ray enters beyond this hold no hit at t or nearer.
SHARED Float last_entry(Float depth_margin, Float t) {
    PRECISE Float last = t + depth_margin;
    return last;
}

/// Whether the ray's line meets the dilated box at some t >= 0, and where it enters (0 inside).
SHARED Bool hits_box(SlabRay s, Float3 lower, Float3 upper, OUT(Float) t_enter) {
    PRECISE Float lx = (lower.x - s.org_lower.x) * s.rdir.x;
    PRECISE Float ux = (upper.x - s.org_upper.x) * s.rdir.x;
    PRECISE Float ly = (lower.y - s.org_lower.y) * s.rdir.y;
    PRECISE Float uy = (upper.y - s.org_upper.y) * s.rdir.y;
    PRECISE Float lz = (lower.z - s.org_lower.z) * s.rdir.z;
    PRECISE Float uz = (upper.z - s.org_upper.z) * s.rdir.z;
    Bool nx = s.rdir.x < 0.0f;
    Bool ny = s.rdir.y < 0.0f;
    Bool nz = s.rdir.z < 0.0f;
    Float enter =
        greater(greater(select(nx, ux, lx), select(ny, uy, ly)), greater(select(nz, uz, lz), 0.0f));
    Float leave = lesser(lesser(select(nx, lx, ux), select(ny, ly, uy)), select(nz, lz, uz));
    t_enter = enter;
    return enter <= leave;
}

SHARED_END

#endif  // per Float type
