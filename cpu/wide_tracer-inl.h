// The traversal of cpu/wide_tracer.h, compiled once for each target.
//
// A node's 16 boxes are tested at once by the very operations of hits_box, so that the same boxes
// are met with the same t_enter. A leaf's vertices are projected at once, then all its triangles
// are sorted out by the operations of may_hit_triangle; what is left goes to intersect_triangle,
// the scalar rule. So no vector operation decides a bit of the answer.
#if defined(MORPHRAY_CPU_WIDE_TRACER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_WIDE_TRACER_INL_H
#undef MORPHRAY_CPU_WIDE_TRACER_INL_H
#else
#define MORPHRAY_CPU_WIDE_TRACER_INL_H
#endif

#include <hwy/highway.h>

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <span>

#include "common/bvh.h"
#include "common/interop/layout.h"
#include "common/interop/triangle.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::CappedTag<float, kWidth>;
using UintTag = hn::RebindToUnsigned<FloatTag>;
using FloatVec = hn::Vec<FloatTag>;
using UintVec = hn::Vec<UintTag>;

inline constexpr FloatTag kFloats;
inline constexpr UintTag kUints;
inline constexpr std::size_t kLanes = hn::MaxLanes(FloatTag());
// Vectors for the 16 slots of a node or a leaf.
inline constexpr std::size_t kVectors = kWidth / kLanes;

HWY_INLINE std::uint32_t bits_of(hn::Mask<FloatTag> mask) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(kFloats, mask, bytes);
    std::uint32_t bits;
    std::memcpy(&bits, bytes, sizeof bits);
    return bits;
}

/// What the 16-wide slab test needs of a ray: near and far planes by the signs of its direction.
struct WideSlab {
    explicit HWY_INLINE WideSlab(const SlabRay& slab) {
        set(0, slab.rdir.x, slab.org_lower.x, slab.org_upper.x, kNodeLowerX, kNodeUpperX);
        set(1, slab.rdir.y, slab.org_lower.y, slab.org_upper.y, kNodeLowerY, kNodeUpperY);
        set(2, slab.rdir.z, slab.org_lower.z, slab.org_upper.z, kNodeLowerZ, kNodeUpperZ);
    }

    FloatVec rdir[3];
    FloatVec near_org[3];
    FloatVec far_org[3];
    // Of the planes in a node, in bytes.
    std::size_t near_offset[3];
    std::size_t far_offset[3];

private:
    HWY_INLINE void set(int axis, float r, float org_lower, float org_upper, uint lower_vec4,
                        uint upper_vec4) {
        const bool negative = r < 0.0f;
        rdir[axis] = hn::Set(kFloats, r);
        near_org[axis] = hn::Set(kFloats, negative ? org_upper : org_lower);
        far_org[axis] = hn::Set(kFloats, negative ? org_lower : org_upper);
        near_offset[axis] = 16 * (negative ? upper_vec4 : lower_vec4);
        far_offset[axis] = 16 * (negative ? lower_vec4 : upper_vec4);
    }
};

HWY_INLINE FloatVec load_planes(const Node& node, std::size_t offset, std::size_t vector) {
    const std::byte* bytes = reinterpret_cast<const std::byte*>(&node) + offset;
    return hn::LoadU(kFloats, reinterpret_cast<const float*>(bytes) + vector * kLanes);
}

/// The slots whose boxes the ray meets no later than t, as bits; where it enters each box.
/// The operations are those of hits_box: a bit is set where hits_box is true and t_enter <= t.
HWY_INLINE std::uint32_t hit_slots(const WideSlab& slab, const Node& node, FloatVec t,
                                   float* HWY_RESTRICT t_enter) {
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        FloatVec near[3];
        FloatVec far[3];
        for (int axis = 0; axis < 3; ++axis) {
            const FloatVec n = load_planes(node, slab.near_offset[axis], v);
            const FloatVec f = load_planes(node, slab.far_offset[axis], v);
            near[axis] = hn::Mul(hn::Sub(n, slab.near_org[axis]), slab.rdir[axis]);
            far[axis] = hn::Mul(hn::Sub(f, slab.far_org[axis]), slab.rdir[axis]);
        }
        const FloatVec enter =
            hn::Max(hn::Max(near[0], near[1]), hn::Max(near[2], hn::Zero(kFloats)));
        const FloatVec leave = hn::Min(hn::Min(far[0], far[1]), hn::Min(far[2], t));
        slots |= bits_of(hn::Le(enter, leave)) << (v * kLanes);
        hn::StoreU(enter, kFloats, t_enter + v * kLanes);
    }
    return slots;
}

/// What the test of a leaf needs of a ray.
struct WideShear {
    explicit HWY_INLINE WideShear(const ShearedRay& s)
        : org_x(hn::Set(kFloats, s.org.x)),
          org_y(hn::Set(kFloats, s.org.y)),
          org_z(hn::Set(kFloats, s.org.z)),
          dir_x(hn::Set(kFloats, s.dir.x)),
          dir_y(hn::Set(kFloats, s.dir.y)),
          dir_z(hn::Set(kFloats, s.dir.z)),
          axis(s.axis) {}

    FloatVec org_x, org_y, org_z;
    FloatVec dir_x, dir_y, dir_z;
    uint axis;
};

#if HWY_TARGET == HWY_SCALAR

HWY_INLINE vec3 position(const LeafVertex& v) { return {v.x, v.y, v.z}; }

/// The triangles of the leaf that the ray may hit, as bits.
HWY_INLINE std::uint32_t may_hit_triangles(const ShearedRay& s, const WideShear&,
                                           const Leaf& leaf) {
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    std::uint32_t triangles = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t corners = leaf.vertex[i].corners;
        const bool may = may_hit_triangle(s, position(leaf.vertex[corner(corners, 0)]),
                                          position(leaf.vertex[corner(corners, 1)]),
                                          position(leaf.vertex[corner(corners, 2)]));
        triangles |= static_cast<std::uint32_t>(may) << i;
    }
    return triangles;
}

#else

/// x of the 16 vertices or of one corner of the 16 triangles of a leaf, and so on.
struct Points {
    FloatVec x[kVectors];
    FloatVec y[kVectors];
    FloatVec z[kVectors];
};

/// project_fast of all vertices of the leaf.
HWY_INLINE Points project_vertices(const WideShear& s, const Leaf& leaf,
                                   UintVec* HWY_RESTRICT corners) {
    Points points;
    for (std::size_t v = 0; v < kVectors; ++v) {
        FloatVec p[3];
        FloatVec w;
        hn::LoadInterleaved4(kFloats, &leaf.vertex[v * kLanes].x, p[0], p[1], p[2], w);
        corners[v] = hn::BitCast(kUints, w);
        const FloatVec x = s.axis == 0 ? p[1] : s.axis == 1 ? p[2] : p[0];
        const FloatVec y = s.axis == 0 ? p[2] : s.axis == 1 ? p[0] : p[1];
        const FloatVec z = s.axis == 0 ? p[0] : s.axis == 1 ? p[1] : p[2];
        const FloatVec ax = hn::Sub(x, s.org_x);
        const FloatVec ay = hn::Sub(y, s.org_y);
        const FloatVec az = hn::Sub(z, s.org_z);
        const FloatVec snap = hn::Set(kFloats, kProjectedSnap);
        const FloatVec px = hn::Sub(hn::Mul(ax, s.dir_z), hn::Mul(s.dir_x, az));
        const FloatVec py = hn::Sub(hn::Mul(ay, s.dir_z), hn::Mul(s.dir_y, az));
        points.x[v] = hn::Sub(hn::Add(px, snap), snap);
        points.y[v] = hn::Sub(hn::Add(py, snap), snap);
        points.z[v] = az;
    }
    return points;
}

/// The vertices that the triangles have at corner i.
HWY_INLINE Points gather_corner(const Points& points, const UintVec* HWY_RESTRICT corners, int i) {
    HWY_ALIGN float table[3][kWidth];
    for (std::size_t v = 0; v < kVectors; ++v) {
        hn::Store(points.x[v], kFloats, table[0] + v * kLanes);
        hn::Store(points.y[v], kFloats, table[1] + v * kLanes);
        hn::Store(points.z[v], kFloats, table[2] + v * kLanes);
    }
    Points gathered;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const UintVec slot = hn::And(hn::ShiftRightSame(corners[v], 8 * i), hn::Set(kUints, 0xFFu));
        const auto index = hn::BitCast(hn::RebindToSigned<UintTag>(), slot);
        gathered.x[v] = hn::GatherIndex(kFloats, table[0], index);
        gathered.y[v] = hn::GatherIndex(kFloats, table[1], index);
        gathered.z[v] = hn::GatherIndex(kFloats, table[2], index);
    }
    return gathered;
}

HWY_INLINE FloatVec size_of(FloatVec x, FloatVec y) { return hn::Add(hn::Abs(x), hn::Abs(y)); }

/// u * v - x * y, rounded after each operation.
HWY_INLINE FloatVec difference(FloatVec u, FloatVec v, FloatVec x, FloatVec y) {
    return hn::Sub(hn::Mul(u, v), hn::Mul(x, y));
}

/// The triangles of the leaf that the ray may hit, as bits.
HWY_INLINE std::uint32_t may_hit_triangles(const ShearedRay&, const WideShear& s,
                                           const Leaf& leaf) {
    UintVec corners[kVectors];
    const Points points = project_vertices(s, leaf, corners);
    const Points a = gather_corner(points, corners, 0);
    const Points b = gather_corner(points, corners, 1);
    const Points c = gather_corner(points, corners, 2);
    std::uint32_t triangles = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const FloatVec m = hn::Add(hn::Add(size_of(a.x[v], a.y[v]), size_of(b.x[v], b.y[v])),
                                   size_of(c.x[v], c.y[v]));
        const FloatVec nearest = hn::Min(a.z[v], hn::Min(b.z[v], c.z[v]));
        const FloatVec farthest = hn::Max(a.z[v], hn::Max(b.z[v], c.z[v]));
        const FloatVec z = hn::Max(hn::Abs(nearest), hn::Abs(farthest));
        const FloatVec r = hn::Mul(hn::Set(kFloats, kFastProjectionError), hn::Add(m, z));
        const FloatVec bound = hn::Mul(r, hn::Add(m, r));
        const FloatVec eu = difference(b.x[v], c.y[v], b.y[v], c.x[v]);
        const FloatVec ev = difference(c.x[v], a.y[v], c.y[v], a.x[v]);
        const FloatVec ew = difference(a.x[v], b.y[v], a.y[v], b.x[v]);
        const FloatVec smallest = hn::Min(eu, hn::Min(ev, ew));
        const FloatVec largest = hn::Max(eu, hn::Max(ev, ew));
        const auto may = hn::Or(hn::Ge(smallest, hn::Neg(bound)), hn::Le(largest, bound));
        triangles |= bits_of(may) << (v * kLanes);
    }
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    return triangles & ((1u << count) - 1);
}

#endif  // HWY_TARGET

HWY_INLINE vec3 position_of(const Leaf& leaf, std::uint32_t triangle, uint i) {
    const LeafVertex& v = leaf.vertex[corner(leaf.vertex[triangle].corners, i)];
    return {v.x, v.y, v.z};
}

/// The scalar rule for one triangle of a leaf.
HWY_INLINE bool intersect_slot(const ShearedRay& s, float tnear, float tfar, const Leaf& leaf,
                               std::uint32_t triangle, TriangleHit& hit) {
    return intersect_triangle(s, tnear, tfar, position_of(leaf, triangle, 0),
                              position_of(leaf, triangle, 1), position_of(leaf, triangle, 2), hit);
}

struct WideEntry {
    float t_enter;
    std::uint32_t child;
};

/// Children still to visit. The builder bounds the depth, and with it the size.
class WideStack {
public:
    HWY_INLINE WideStack() { entries_[0] = {0, 0}; }

    HWY_INLINE bool empty() const { return size_ == 0; }
    HWY_INLINE WideEntry pop() { return entries_[--size_]; }

    /// Pushes these slots' children so that the nearest is popped first.
    HWY_INLINE void push(const Node& node, std::uint32_t slots, const float* t_enter) {
        const std::uint32_t base = size_;
        for (; slots != 0; slots &= slots - 1) {
            const auto slot = static_cast<std::uint32_t>(std::countr_zero(slots));
            assert(size_ < kMaxStack);
            std::uint32_t place = size_++;
            for (; place > base && entries_[place - 1].t_enter < t_enter[slot]; --place) {
                entries_[place] = entries_[place - 1];
            }
            entries_[place] = {t_enter[slot], node.child[slot]};
        }
    }

private:
    std::uint32_t size_ = 1;
    WideEntry entries_[kMaxStack];
};

HWY_INLINE Hit intersect_ray(const Bvh& bvh, const Ray& ray) {
    const ShearedRay sheared = shear_ray(ray.org, ray.dir);
    const WideShear shear(sheared);
    const WideSlab slab(slab_ray(ray.org, ray.dir));
    Hit best = no_hit();
    float best_t = ray.tfar;
    WideStack stack;
    while (!stack.empty()) {
        const WideEntry entry = stack.pop();
        if (entry.t_enter > best_t) continue;
        if ((entry.child & kLeafBit) == 0) {
            const Node& node = bvh.nodes[entry.child];
            HWY_ALIGN float t_enter[kWidth];
            stack.push(node, hit_slots(slab, node, hn::Set(kFloats, best_t), t_enter), t_enter);
            continue;
        }
        const Leaf& leaf = bvh.leaves[entry.child & ~kLeafBit];
        std::uint32_t triangles = may_hit_triangles(sheared, shear, leaf);
        for (; triangles != 0; triangles &= triangles - 1) {
            const auto triangle = static_cast<std::uint32_t>(std::countr_zero(triangles));
            TriangleHit hit;
            if (intersect_slot(sheared, ray.tnear, ray.tfar, leaf, triangle, hit) &&
                wins(hit.t, leaf.prim_id[triangle], best_t, best.prim_id)) {
                best_t = hit.t;
                best = make_hit(hit, leaf.prim_id[triangle]);
            }
        }
    }
    return best;
}

HWY_INLINE bool occluded_ray(const Bvh& bvh, const Ray& ray) {
    const ShearedRay sheared = shear_ray(ray.org, ray.dir);
    const WideShear shear(sheared);
    const WideSlab slab(slab_ray(ray.org, ray.dir));
    const FloatVec tfar = hn::Set(kFloats, ray.tfar);
    WideStack stack;
    while (!stack.empty()) {
        const WideEntry entry = stack.pop();
        if ((entry.child & kLeafBit) == 0) {
            const Node& node = bvh.nodes[entry.child];
            HWY_ALIGN float t_enter[kWidth];
            stack.push(node, hit_slots(slab, node, tfar, t_enter), t_enter);
            continue;
        }
        const Leaf& leaf = bvh.leaves[entry.child & ~kLeafBit];
        std::uint32_t triangles = may_hit_triangles(sheared, shear, leaf);
        for (; triangles != 0; triangles &= triangles - 1) {
            const auto triangle = static_cast<std::uint32_t>(std::countr_zero(triangles));
            TriangleHit hit;
            if (intersect_slot(sheared, ray.tnear, ray.tfar, leaf, triangle, hit)) return true;
        }
    }
    return false;
}

void intersect_rays(const Bvh& bvh, std::span<const Ray> rays, std::span<Hit> hits) {
    for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = intersect_ray(bvh, rays[i]);
}

void occluded_rays(const Bvh& bvh, std::span<const Ray> rays, std::span<std::uint8_t> occluded) {
    for (std::size_t i = 0; i < rays.size(); ++i) occluded[i] = occluded_ray(bvh, rays[i]);
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
