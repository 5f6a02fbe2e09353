// The slab test of a ray against a box, and the pad of the boxes of leaves.
//
// Conservative: a ray passes the box of a triangle that it hits within 3 * 2^-24 of the box's
// largest extent and 2^-42 E, with E = max(kSceneExtent, |org|). Stored boxes are padded by the
// first part (plane_pad). The ray dilates them by the second part and the test's own rounding.
//
// A hit lies no nearer than its box begins on the axis of the direction's largest component; and no
// nearer than where the ray enters the box, less the depth margin M = kDepthMargin * E. Both are up
// to rounding (last_depth).
//
// Monotone: a plane goes through one subtraction of a per-ray constant and one multiplication by
// one. So the interval of a box inside another is inside the other's, bit for bit, and a tree gives
// the answers of the triangles' own padded boxes (docs/design/arithmetic.md, "Boxes").
#if !defined(COMMON_INTEROP_SLAB_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_SLAB_H
#define COMMON_INTEROP_SLAB_H

#include "common/interop/arithmetic.h"
#include "common/interop/ray.h"

#endif

SHARED_BEGIN

/// The largest extent of bounds; 0 if they are empty.
SHARED Float largest_extent(Float3 lower, Float3 upper) {
    PRECISE Float3 extent = upper - lower;
    return greater(greater(extent.x, extent.y), greater(extent.z, 0.0f));
}

/// How far a plane of a leaf's box is moved outwards, by largest_extent of the leaf's vertices.
/// Checked: lab/proofs/boxes.g.
SHARED Float plane_pad(Float plane, Float extent) {
    PRECISE Float pad = kPadOfExtent * extent + kPadOfPlane * abs(plane);
    return pad;
}

/// A ray as the slab test takes it. Lower planes are taken relative to org + D, upper planes
/// relative to org - D, which dilates the box by D. axis is that of the largest component of dir.
struct SlabRay {
    Float3 rdir, org_lower, org_upper;
    Float depth_margin;
    Uint axis;
};

/// 1/d to half an ulp and little more, or what stands for it: rcp() and one step with an exact
/// residual. Checked: lab/proofs/boxes.g.
SHARED Float slab_reciprocal(Float d) {
    Bool is_zero = d == 0.0f;
    Float x = select(is_zero, 1.0f, d);
    Float y = rcp(x);
    PRECISE Float p = x * y;
    PRECISE Float e = (1.0f - p) - product_error(x, y, p);
    PRECISE Float r = y + y * e;
    return select(is_zero, kHugeReciprocal, r);
}

/// E: the size of coordinates that a ray from org has to do with.
SHARED Float extent_of_rays(Float3 org) { return greater(largest_component(org), kSceneExtent); }

/// The least D for rays from org. Checked: lab/proofs/boxes.g.
SHARED Float least_dilation(Float3 org) {
    PRECISE Float d = kDilationOfExtent * extent_of_rays(org);
    return d;
}

/// M for rays from org. Checked: lab/proofs/boxes.g.
SHARED Float depth_margin(Float3 org) {
    PRECISE Float m = kDepthMargin * extent_of_rays(org);
    return m;
}

/// Checked: lab/proofs/boxes.g.
SHARED SlabRay slab_ray(Float3 org, Float3 dir) {
    Float least = least_dilation(org);
    PRECISE Float3 d =
        Float3(kDilationOfOrigin * abs(org.x) + least, kDilationOfOrigin * abs(org.y) + least,
               kDilationOfOrigin * abs(org.z) + least);
    SlabRay s;
    s.rdir = Float3(slab_reciprocal(dir.x), slab_reciprocal(dir.y), slab_reciprocal(dir.z));
    PRECISE Float3 below = org + d;
    PRECISE Float3 above = org - d;
    s.org_lower = below;
    s.org_upper = above;
    s.depth_margin = depth_margin(org);
    s.axis = largest_axis(dir);
    return s;
}

/// Boxes that the ray enters beyond this hold no hit at t or nearer.
SHARED Float last_entry(Float depth_margin, Float t) {
    PRECISE Float last = t + depth_margin;
    return last;
}

/// Boxes whose least depth is beyond this hold no hit at t or nearer.
SHARED Float last_depth(Float t) {
    PRECISE Float last = t * kDepthRounding;
    return last;
}

/// The least depth of hits in a box that the ray enters at `enter`, and on its main axis at
/// `along`.
SHARED Float least_depth(Float enter, Float along, Float depth_margin) {
    PRECISE Float early = enter - depth_margin;
    return greater(greater(along, early), 0.0f);
}

/// Where the ray's line enters the dilated box on each axis, and where it leaves the box.
SHARED Float3 box_entries(SlabRay s, Float3 lower, Float3 upper, OUT(Float) leave) {
    PRECISE Float lx = (lower.x - s.org_lower.x) * s.rdir.x;
    PRECISE Float ux = (upper.x - s.org_upper.x) * s.rdir.x;
    PRECISE Float ly = (lower.y - s.org_lower.y) * s.rdir.y;
    PRECISE Float uy = (upper.y - s.org_upper.y) * s.rdir.y;
    PRECISE Float lz = (lower.z - s.org_lower.z) * s.rdir.z;
    PRECISE Float uz = (upper.z - s.org_upper.z) * s.rdir.z;
    Bool nx = s.rdir.x < 0.0f;
    Bool ny = s.rdir.y < 0.0f;
    Bool nz = s.rdir.z < 0.0f;
    Float end = lesser(lesser(select(nx, lx, ux), select(ny, ly, uy)), select(nz, lz, uz));
    PRECISE Float last = end * kSlabRounding;
    leave = last;
    return Float3(select(nx, ux, lx), select(ny, uy, ly), select(nz, uz, lz));
}

/// True if the ray's line meets the dilated box at some t >= 0. t_least: no hit in it is nearer.
SHARED Bool hits_box(SlabRay s, Float3 lower, Float3 upper, OUT(Float) t_least) {
    Float leave;
    Float3 near = box_entries(s, lower, upper, leave);
    Float enter = greater(greater(near.x, near.y), greater(near.z, 0.0f));
    Float along = select(s.axis == 0u, near.x, select(s.axis == 1u, near.y, near.z));
    t_least = least_depth(enter, along, s.depth_margin);
    return enter <= leave;
}

/// The interval of t in which the ray's line passes the padded box of vertices with these bounds,
/// widened by kIntervalRounding of each end, so that rounding moves no t of the interval outside.
SHARED void padded_interval(SlabRay s, Float3 lower, Float3 upper, OUT(Float) first,
                            OUT(Float) last) {
    Float extent = largest_extent(lower, upper);
    PRECISE Float3 least =
        Float3(lower.x - plane_pad(lower.x, extent), lower.y - plane_pad(lower.y, extent),
               lower.z - plane_pad(lower.z, extent));
    PRECISE Float3 most =
        Float3(upper.x + plane_pad(upper.x, extent), upper.y + plane_pad(upper.y, extent),
               upper.z + plane_pad(upper.z, extent));
    Float leave;
    Float3 near = box_entries(s, least, most, leave);
    Float enter = greater(greater(near.x, near.y), greater(near.z, 0.0f));
    PRECISE Float early = enter - kIntervalRounding * enter;
    PRECISE Float late = leave + kIntervalRounding * leave;
    first = early;
    last = late;
}

SHARED_END

#endif  // per Float type
