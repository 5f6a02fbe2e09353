// The slab test of a ray against a box dilated by D = kBoxDilation * max(kSceneExtent, |org|).
//
// A hit lies inside its triangle's box up to rounding, which is a small part of D: so the ray
// always meets the dilated box of a triangle that it hits, and enters it at t_enter <= t of the
// hit. Monotone by construction: every plane goes through one subtraction of a per-ray constant and
// one multiplication by a per-ray constant, and rounding is monotone, so for a box inside another
// the interval lies inside the other's interval bit for bit. No epsilon is needed for a tree of
// boxes to answer as its triangles' own boxes do, and a box with t_enter > t of the best hit so far
// holds nothing better (docs/design/arithmetic.md, "Boxes").
#ifndef COMMON_INTEROP_SLAB_H
#define COMMON_INTEROP_SLAB_H

#include "common/interop/arithmetic.h"
#include "common/interop/ray.h"

SHARED_BEGIN

/// What the slab test needs of a ray. lower planes are taken relative to org + D, upper planes
/// relative to org - D, which dilates the box by D.
struct SlabRay {
    vec3 rdir;
    vec3 org_lower;
    vec3 org_upper;
};

SHARED float slab_reciprocal(float d) { return d == 0.0f ? kHugeReciprocal : rcp(d); }

/// D for rays from org.
/// Checked: proofs/boxes.g.
SHARED float box_dilation(vec3 org) {
    PRECISE float d = kBoxDilation * greater(largest_component(org), kSceneExtent);
    return d;
}

SHARED SlabRay slab_ray(vec3 org, vec3 dir) {
    float d = box_dilation(org);
    SlabRay s;
    s.rdir = vec3(slab_reciprocal(dir.x), slab_reciprocal(dir.y), slab_reciprocal(dir.z));
    PRECISE vec3 below = vec3(org.x + d, org.y + d, org.z + d);
    PRECISE vec3 above = vec3(org.x - d, org.y - d, org.z - d);
    s.org_lower = below;
    s.org_upper = above;
    return s;
}

/// Whether the ray's line meets the dilated box at some t >= 0, and where it enters (0 inside).
SHARED bool hits_box(SlabRay s, vec3 lower, vec3 upper, OUT(float) t_enter) {
    PRECISE float lx = (lower.x - s.org_lower.x) * s.rdir.x;
    PRECISE float ux = (upper.x - s.org_upper.x) * s.rdir.x;
    PRECISE float ly = (lower.y - s.org_lower.y) * s.rdir.y;
    PRECISE float uy = (upper.y - s.org_upper.y) * s.rdir.y;
    PRECISE float lz = (lower.z - s.org_lower.z) * s.rdir.z;
    PRECISE float uz = (upper.z - s.org_upper.z) * s.rdir.z;
    bool nx = s.rdir.x < 0.0f;
    bool ny = s.rdir.y < 0.0f;
    bool nz = s.rdir.z < 0.0f;
    float enter = greater(greater(nx ? ux : lx, ny ? uy : ly), greater(nz ? uz : lz, 0.0f));
    float leave = lesser(lesser(nx ? lx : ux, ny ? ly : uy), nz ? lz : uz);
    t_enter = enter;
    return enter <= leave;
}

SHARED_END

#endif  // COMMON_INTEROP_SLAB_H
