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
using ByteTag = hn::Repartition<std::uint8_t, FloatTag>;
using FloatVec = hn::Vec<FloatTag>;
using UintVec = hn::Vec<UintTag>;

inline constexpr FloatTag kFloats;
inline constexpr UintTag kUints;
inline constexpr ByteTag kBytes;
inline constexpr std::size_t kLanes = hn::MaxLanes(FloatTag());
// Vectors for the 16 slots of a node or a leaf.
inline constexpr std::size_t kVectors = kWidth / kLanes;

#ifndef CHUNK
#define CHUNK 32
#endif
#ifndef BATCH
#define BATCH 64
#endif
inline constexpr std::size_t kStreamRays = BATCH;
inline constexpr std::size_t kStreamChunk = CHUNK;
inline constexpr std::size_t kStreamStack = kStreamRays + (kMaxDepth - 1) * 16 * kStreamChunk;

HWY_INLINE std::uint32_t bits_of(hn::Mask<FloatTag> mask) {
    if constexpr (kLanes > 8) {
        std::uint16_t bits;
        hn::StoreMaskBits(kFloats, mask, reinterpret_cast<std::uint8_t*>(&bits));
        return bits;
    } else {
        std::uint8_t bits;
        hn::StoreMaskBits(kFloats, mask, &bits);
        return bits;
    }
}

HWY_INLINE FloatVec max3(FloatVec a, FloatVec b, FloatVec c) { return hn::Max(a, hn::Max(b, c)); }
HWY_INLINE FloatVec min3(FloatVec a, FloatVec b, FloatVec c) { return hn::Min(a, hn::Min(b, c)); }
HWY_INLINE FloatVec sum3(FloatVec a, FloatVec b, FloatVec c) { return hn::Add(hn::Add(a, b), c); }

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

using FloatMask = hn::Mask<FloatTag>;

/// Whether the ray meets the boxes of vector v of the slots no later than t, and where it enters
/// them. The operations are those of hits_box: true where hits_box is and t_enter <= t.
HWY_INLINE FloatMask hits_boxes(const WideSlab& slab, const Node& node, std::size_t v, FloatVec t,
                                FloatVec& t_enter) {
    FloatVec near[3];
    FloatVec far[3];
    for (int axis = 0; axis < 3; ++axis) {
        const FloatVec n = load_planes(node, slab.near_offset[axis], v);
        const FloatVec f = load_planes(node, slab.far_offset[axis], v);
        near[axis] = hn::Mul(hn::Sub(n, slab.near_org[axis]), slab.rdir[axis]);
        far[axis] = hn::Mul(hn::Sub(f, slab.far_org[axis]), slab.rdir[axis]);
    }
    t_enter = hn::Max(hn::Max(near[0], near[1]), hn::Max(near[2], hn::Zero(kFloats)));
    return hn::Le(t_enter, hn::Min(hn::Min(far[0], far[1]), hn::Min(far[2], t)));
}

/// The slots whose boxes the ray meets no later than t, as bits; where it enters each box.
HWY_INLINE std::uint32_t hit_slots(const WideSlab& slab, const Node& node, FloatVec t,
                                   float* HWY_RESTRICT t_enter) {
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        FloatVec enter;
        slots |= bits_of(hits_boxes(slab, node, v, t, enter)) << (v * kLanes);
        hn::StoreU(enter, kFloats, t_enter + v * kLanes);
    }
    return slots;
}

/// What tracing takes of some rays, computed for a vector of them at a time and read for one.
struct alignas(64) RayStream {
    float rdir[3][kStreamRays];
    float near_org[3][kStreamRays];
    float far_org[3][kStreamRays];
    float tfar[kStreamRays];
    std::uint32_t near_offset[3][kStreamRays];
    float org[3][kStreamRays];
    float dir[3][kStreamRays];
    float away[kStreamRays];
    std::uint32_t axis[kStreamRays];
};

HWY_INLINE FloatVec select(FloatMask which, FloatVec yes, FloatVec no) {
    return hn::IfThenElse(which, yes, no);
}

/// slab_reciprocal of each lane.
HWY_INLINE FloatVec slab_reciprocals(FloatVec d) {
    const FloatVec zero = hn::Zero(kFloats);
    const FloatVec one = hn::Set(kFloats, 1.0f);
    const FloatVec two = hn::Set(kFloats, 2.0f);
    const FloatMask none = hn::Eq(d, zero);
    const FloatVec ad = select(none, one, hn::Abs(d));
    FloatVec y = hn::BitCast(
        kFloats, hn::Sub(hn::Set(kUints, 0x7EF311C7u), hn::BitCast(kUints, ad)));
    y = hn::Mul(y, hn::Sub(two, hn::Mul(ad, y)));
    y = hn::Mul(y, hn::Sub(two, hn::Mul(ad, y)));
    y = hn::Add(y, hn::Mul(y, hn::Sub(one, hn::Mul(ad, y))));
    y = select(hn::Lt(d, zero), hn::Neg(y), y);
    return select(none, hn::Set(kFloats, kHugeReciprocal), y);
}

/// Fills lanes [i, i + kLanes) by the operations of slab_ray and shear_ray.
HWY_INLINE void prepare_rays(RayStream& s, std::size_t i) {
    const FloatVec zero = hn::Zero(kFloats);
    FloatVec org[3];
    FloatVec dir[3];
    for (int axis = 0; axis < 3; ++axis) {
        org[axis] = hn::LoadU(kFloats, s.org[axis] + i);
        dir[axis] = hn::LoadU(kFloats, s.dir[axis] + i);
    }
    const FloatVec extent =
        max3(hn::Abs(org[0]), hn::Abs(org[1]), hn::Max(hn::Abs(org[2]), hn::Set(kFloats, kSceneExtent)));
    const FloatVec dilation = hn::Mul(hn::Set(kFloats, kBoxDilation), extent);
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        const FloatVec rdir = slab_reciprocals(dir[axis]);
        const FloatMask negative = hn::Lt(rdir, zero);
        const FloatVec below = hn::Add(org[axis], dilation);
        const FloatVec above = hn::Sub(org[axis], dilation);
        hn::StoreU(rdir, kFloats, s.rdir[axis] + i);
        hn::StoreU(select(negative, above, below), kFloats, s.near_org[axis] + i);
        hn::StoreU(select(negative, below, above), kFloats, s.far_org[axis] + i);
        const UintVec lower = hn::Set(kUints, axis * 128);
        const UintVec upper = hn::Set(kUints, axis * 128 + 64);
        hn::StoreU(hn::IfThenElse(hn::RebindMask(kUints, negative), upper, lower), kUints,
                   s.near_offset[axis] + i);
    }
    const FloatVec size[3] = {hn::Abs(dir[0]), hn::Abs(dir[1]), hn::Abs(dir[2])};
    const FloatMask is_x = hn::And(hn::Ge(size[0], size[1]), hn::Ge(size[0], size[2]));
    const FloatMask is_y = hn::Ge(size[1], size[2]);
    for (int k = 0; k < 3; ++k) {
        const int y = (k + 1) % 3;
        const int z = (k + 2) % 3;
        const FloatVec o = select(is_x, org[y], select(is_y, org[z], org[k]));
        const FloatVec d = select(is_x, dir[y], select(is_y, dir[z], dir[k]));
        hn::StoreU(o, kFloats, s.org[k] + i);
        hn::StoreU(d, kFloats, s.dir[k] + i);
        if (k == 2) {
            hn::StoreU(hn::And(d, hn::Set(kFloats, -0.0f)), kFloats, s.away + i);
        }
    }
    const UintVec axis = hn::IfThenElse(
        hn::RebindMask(kUints, is_x), hn::Zero(kUints),
        hn::IfThenElse(hn::RebindMask(kUints, is_y), hn::Set(kUints, 1u), hn::Set(kUints, 2u)));
    hn::StoreU(axis, kUints, s.axis + i);
}

/// Prepares up to kStreamRays rays.
HWY_INLINE void fill_stream(RayStream& s, const Ray* rays, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
        const Ray& ray = rays[i];
        s.org[0][i] = ray.org.x;
        s.org[1][i] = ray.org.y;
        s.org[2][i] = ray.org.z;
        s.dir[0][i] = ray.dir.x;
        s.dir[1][i] = ray.dir.y;
        s.dir[2][i] = ray.dir.z;
        s.tfar[i] = ray.tfar;
    }
    // The rest of the last vector: any numbers will do, but no garbage that raises flags.
    for (std::size_t i = count; i % kLanes != 0; ++i) {
        for (int axis = 0; axis < 3; ++axis) s.org[axis][i] = s.dir[axis][i] = 0;
    }
    for (std::size_t i = 0; i < count; i += kLanes) prepare_rays(s, i);
}

/// For each axis, the bytes of (x, y, z, w) in the order that rotate_axes gives x, y and z.
alignas(16) inline constexpr std::uint8_t kRotations[3][16] = {
    {4, 5, 6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 12, 13, 14, 15},
    {8, 9, 10, 11, 0, 1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 15},
    {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15},
};

inline constexpr float kDepthError = 3.814697265625e-06f; // 2^-18

#if HWY_TARGET == HWY_SCALAR
struct WideShear {
    explicit WideShear(const ShearedRay&) {}
    WideShear(const RayStream&, std::size_t) {}
};
#else
/// What the test of a leaf needs of a ray.
struct WideShear {
    explicit HWY_INLINE WideShear(const ShearedRay& s)
        : org_x(hn::Set(kFloats, s.org.x)),
          org_y(hn::Set(kFloats, s.org.y)),
          org_z(hn::Set(kFloats, s.org.z)),
          dir_x(hn::Set(kFloats, s.dir.x)),
          dir_y(hn::Set(kFloats, s.dir.y)),
          dir_z(hn::Set(kFloats, s.dir.z)),
          away(hn::Set(kFloats, s.dir.z < 0.0f ? -0.0f : 0.0f)),
          rotation(hn::LoadDup128(kBytes, kRotations[s.axis])) {}

    HWY_INLINE WideShear(const RayStream& s, std::size_t ray)
        : org_x(hn::Set(kFloats, s.org[0][ray])),
          org_y(hn::Set(kFloats, s.org[1][ray])),
          org_z(hn::Set(kFloats, s.org[2][ray])),
          dir_x(hn::Set(kFloats, s.dir[0][ray])),
          dir_y(hn::Set(kFloats, s.dir[1][ray])),
          dir_z(hn::Set(kFloats, s.dir[2][ray])),
          away(hn::Set(kFloats, s.away[ray])),
          rotation(hn::LoadDup128(kBytes, kRotations[s.axis[ray]])) {}

    FloatVec org_x, org_y, org_z;
    FloatVec dir_x, dir_y, dir_z;
    // The sign of dir_z.
    FloatVec away;
    // Rotates the axes of a vertex, as rotate_axes does.
    hn::Vec<ByteTag> rotation;
};

#endif
#if HWY_TARGET == HWY_SCALAR

HWY_INLINE std::uint32_t slot_of_lane(std::uint32_t lane) { return lane; }

HWY_INLINE vec3 position(const LeafVertex& v) { return {v.x, v.y, v.z}; }

/// The triangles of the leaf that the ray may hit, as bits.
HWY_INLINE std::uint32_t may_hit_triangles(const Ray& ray, const WideShear&, const Leaf& leaf) {
    const ShearedRay s = shear_ray(ray.org, ray.dir);
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

/// x, y and z of the 16 vertices of a leaf, or of one corner of its 16 triangles, and the sizes
/// |x| + |y|.
struct Points {
    FloatVec x[kVectors];
    FloatVec y[kVectors];
    FloatVec z[kVectors];
    FloatVec size[kVectors];
};

// The lanes of a leaf: a vector load brings kBlocks vertices, and transposing four of those in
// blocks of 4 lanes, which is cheap on every target, brings vertex
// 4 * kBlocks * v + kBlocks * (lane % 4) + lane / 4 to lane `lane` of vector v; triangles likewise.
inline constexpr std::size_t kBlocks = kLanes / 4;

HWY_INLINE std::uint32_t slot_of_lane(std::uint32_t lane) {
    constexpr auto blocks = static_cast<std::uint32_t>(kBlocks);
    const std::uint32_t group = lane / (4 * blocks);
    const std::uint32_t in_group = lane % (4 * blocks);
    return 4 * blocks * group + blocks * (in_group % 4) + in_group / 4;
}

/// The slot of each lane of vector v.
HWY_INLINE UintVec slots_of_vector(std::size_t v) {
    const UintVec lane = hn::Iota(kUints, 0u);
    const UintVec in_block = hn::And(lane, hn::Set(kUints, 3u));
    const UintVec block = hn::ShiftRight<2>(lane);
    return hn::Add(hn::Add(hn::Mul(in_block, hn::Set(kUints, static_cast<std::uint32_t>(kBlocks))),
                           block),
                   hn::Set(kUints, static_cast<std::uint32_t>(v * kLanes)));
}

/// project_fast of all vertices of the leaf.
HWY_INLINE Points project_vertices(const WideShear& s, const Leaf& leaf,
                                   UintVec* HWY_RESTRICT corners) {
    using PairTag = hn::Repartition<std::uint64_t, FloatTag>;
    const PairTag pairs;
    Points points;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const float* first = &leaf.vertex[v * kLanes].x;
        hn::Vec<PairTag> rows[4];
        for (std::size_t i = 0; i < 4; ++i) {
            const auto row = hn::BitCast(kBytes, hn::LoadU(kFloats, first + i * kLanes));
            rows[i] = hn::BitCast(pairs, hn::TableLookupBytes(row, s.rotation));
        }
        const auto low = [&](hn::Vec<PairTag> a, hn::Vec<PairTag> b) {
            return hn::BitCast(pairs, hn::InterleaveLower(kFloats, hn::BitCast(kFloats, a),
                                                          hn::BitCast(kFloats, b)));
        };
        const auto high = [&](hn::Vec<PairTag> a, hn::Vec<PairTag> b) {
            return hn::BitCast(pairs, hn::InterleaveUpper(kFloats, hn::BitCast(kFloats, a),
                                                          hn::BitCast(kFloats, b)));
        };
        const auto xy01 = low(rows[0], rows[1]);
        const auto xy23 = low(rows[2], rows[3]);
        const auto zw01 = high(rows[0], rows[1]);
        const auto zw23 = high(rows[2], rows[3]);
        const FloatVec x = hn::BitCast(kFloats, hn::InterleaveLower(pairs, xy01, xy23));
        const FloatVec y = hn::BitCast(kFloats, hn::InterleaveUpper(pairs, xy01, xy23));
        const FloatVec z = hn::BitCast(kFloats, hn::InterleaveLower(pairs, zw01, zw23));
        corners[v] = hn::BitCast(kUints, hn::InterleaveUpper(pairs, zw01, zw23));
        const FloatVec ax = hn::Sub(x, s.org_x);
        const FloatVec ay = hn::Sub(y, s.org_y);
        const FloatVec az = hn::Sub(z, s.org_z);
        const FloatVec snap = hn::Set(kFloats, kProjectedSnap);
        const FloatVec px = hn::Sub(hn::Mul(ax, s.dir_z), hn::Mul(s.dir_x, az));
        const FloatVec py = hn::Sub(hn::Mul(ay, s.dir_z), hn::Mul(s.dir_y, az));
        points.x[v] = hn::Sub(hn::Add(px, snap), snap);
        points.y[v] = hn::Sub(hn::Add(py, snap), snap);
        points.z[v] = az;
        points.size[v] = hn::Add(hn::Abs(points.x[v]), hn::Abs(points.y[v]));
    }
    return points;
}

/// Takes from vectors over all vertices those that triangles have at one corner.
class CornerGather {
public:
    /// Corner i of the triangles of one vector.
    HWY_INLINE CornerGather(UintVec corners, int i)
        : slots_(hn::And(hn::ShiftRightSame(corners, 8 * i), hn::Set(kUints, 15u))) {}

    HWY_INLINE FloatVec operator()(const FloatVec* values) const {
        if constexpr (kVectors == 1) {
            return hn::TableLookupLanes(values[0], hn::IndicesFromVec(kFloats, lane()));
        } else if constexpr (kVectors == 2) {
            const auto lanes = hn::IndicesFromVec(kFloats, lane());
            const FloatVec second = hn::BitCast(kFloats, hn::ShiftLeft<28>(slots_));
            return hn::IfNegativeThenElse(second, hn::TableLookupLanes(values[1], lanes),
                                          hn::TableLookupLanes(values[0], lanes));
        } else {
            HWY_ALIGN float table[kWidth];
            for (std::size_t v = 0; v < kVectors; ++v) {
                hn::Store(values[v], kFloats, table + v * kLanes);
            }
            return hn::GatherIndex(kFloats, table,
                                   hn::BitCast(hn::RebindToSigned<UintTag>(), slots_));
        }
    }

private:
    /// Where in its vector a vertex is.
    HWY_INLINE UintVec lane() const {
        if constexpr (kVectors == 1) {
            return hn::Or(hn::ShiftLeft<2>(hn::And(slots_, hn::Set(kUints, 3u))),
                          hn::ShiftRight<2>(slots_));
        } else {
            return hn::Or(hn::ShiftLeft<2>(hn::And(slots_, hn::Set(kUints, 1u))),
                          hn::And(hn::ShiftRight<1>(slots_), hn::Set(kUints, 3u)));
        }
    }

    UintVec slots_;
};

/// u * v - x * y, rounded after each operation.
HWY_INLINE FloatVec difference(FloatVec u, FloatVec v, FloatVec x, FloatVec y) {
    return hn::Sub(hn::Mul(u, v), hn::Mul(x, y));
}


/// The triangles of the leaf that the ray may hit, as bits of lanes.
HWY_INLINE std::uint32_t may_hit_triangles(const Ray&, const WideShear& s,
                                           const Leaf& leaf) {
    UintVec corners[kVectors];
    const Points points = project_vertices(s, leaf, corners);
    std::uint32_t lanes = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const CornerGather a(corners[v], 0);
        const CornerGather b(corners[v], 1);
        const CornerGather c(corners[v], 2);
        const FloatVec ax = a(points.x), ay = a(points.y), az = a(points.z);
        const FloatVec bx = b(points.x), by = b(points.y), bz = b(points.z);
        const FloatVec cx = c(points.x), cy = c(points.y), cz = c(points.z);
        const FloatVec m = sum3(a(points.size), b(points.size), c(points.size));
        const FloatVec z = max3(hn::Abs(az), hn::Abs(bz), hn::Abs(cz));
        const FloatVec r = hn::Mul(hn::Set(kFloats, kFastProjectionError), hn::Add(m, z));
        const FloatVec bound = hn::Mul(r, hn::Add(m, r));
        const FloatVec eu = difference(bx, cy, by, cx);
        const FloatVec ev = difference(cx, ay, cy, ax);
        const FloatVec ew = difference(ax, by, ay, bx);
        const auto inside = hn::Or(hn::Ge(min3(eu, ev, ew), hn::Neg(bound)),
                                   hn::Le(max3(eu, ev, ew), bound));
        const FloatVec au = hn::Abs(eu), av = hn::Abs(ev), aw = hn::Abs(ew);
        const FloatVec depth = sum3(hn::Mul(au, az), hn::Mul(av, bz), hn::Mul(aw, cz));
        const FloatVec slack =
            hn::Mul(z, hn::Add(hn::Mul(hn::Set(kFloats, kDepthError), sum3(au, av, aw)),
                               hn::Mul(hn::Set(kFloats, 4.0f), bound)));
        const auto ahead = hn::Ge(hn::Xor(depth, s.away), hn::Neg(slack));
        const auto used = hn::Lt(slots_of_vector(v), hn::ShiftRight<24>(corners[v]));
        const auto may = hn::And(hn::And(inside, ahead), hn::RebindMask(kFloats, used));
        lanes |= bits_of(may) << (v * kLanes);
    }
    return lanes;
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
        std::uint32_t triangles = may_hit_triangles(ray, shear, leaf);
        for (; triangles != 0; triangles &= triangles - 1) {
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(triangles));
            const std::uint32_t triangle = slot_of_lane(lane);
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

struct WorkItems {
    std::uint32_t child[kStreamStack + kLanes];
    std::uint32_t ray[kStreamStack + kLanes];
};

HWY_INLINE FloatMask stream_boxes(const RayStream& s, std::size_t ray, const Node& node,
                                  std::size_t v) {
    FloatVec near[3];
    FloatVec far[3];
    for (int axis = 0; axis < 3; ++axis) {
        const std::size_t offset = s.near_offset[axis][ray];
        const FloatVec n = load_planes(node, offset, v);
        const FloatVec f = load_planes(node, offset ^ 64u, v);
        const FloatVec rdir = hn::Set(kFloats, s.rdir[axis][ray]);
        near[axis] = hn::Mul(hn::Sub(n, hn::Set(kFloats, s.near_org[axis][ray])), rdir);
        far[axis] = hn::Mul(hn::Sub(f, hn::Set(kFloats, s.far_org[axis][ray])), rdir);
    }
    const FloatVec enter = hn::Max(hn::Max(near[0], near[1]), hn::Max(near[2], hn::Zero(kFloats)));
    return hn::Le(enter, hn::Min(hn::Min(far[0], far[1]),
                                 hn::Min(far[2], hn::Set(kFloats, s.tfar[ray]))));
}

/// Adds the node's children in these slots.
HWY_INLINE std::size_t append(const Node& node, std::uint32_t slots, std::uint32_t ray,
                              WorkItems& items, std::size_t size) {
#if HWY_TARGET <= HWY_AVX3
        const auto which = hn::Mask<UintTag>{static_cast<__mmask16>(slots)};
        const UintVec children = hn::LoadU(kUints, node.child);
        hn::StoreU(hn::Compress(children, which), kUints, items.child + size);
        hn::StoreU(hn::Set(kUints, ray), kUints, items.ray + size);
        return size + static_cast<std::size_t>(std::popcount(slots));
#else
        // Two slots without a branch, then the rest.
        for (int i = 0; i < 2; ++i) {
            items.child[size] = node.child[std::countr_zero(slots | 0x8000u)];
            items.ray[size] = ray;
            size += slots != 0;
            slots &= slots - 1;
        }
        for (; slots != 0; slots &= slots - 1) {
            items.child[size] = node.child[std::countr_zero(slots)];
            items.ray[size] = ray;
            ++size;
        }
        return size;
#endif
}

HWY_INLINE std::uint32_t leaf_slots(const Node& node) {
    using IntTag = hn::RebindToSigned<UintTag>;
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const auto children =
            hn::BitCast(IntTag(), hn::LoadU(kUints, node.child + v * kLanes));
        slots |= bits_of(hn::RebindMask(kFloats, hn::Lt(children, hn::Zero(IntTag()))))
                 << (v * kLanes);
    }
    return slots;
}

HWY_INLINE void occluded_stream(const Bvh& bvh, const Ray* rays, std::size_t count,
                                std::uint8_t* occluded) {
    const Node* nodes = bvh.nodes.data();
    const Leaf* leaves = bvh.leaves.data();
    RayStream stream;
    fill_stream(stream, rays, count);
    WorkItems inner;
    WorkItems outer;
    for (std::size_t i = 0; i < count; ++i) {
        occluded[i] = 0;
        inner.child[i] = 0;
        inner.ray[i] = static_cast<std::uint32_t>(i);
    }
    std::size_t size = count;
    while (size > 0) {
        std::uint32_t child[kStreamChunk];
        std::uint32_t ray[kStreamChunk];
        const std::size_t k = size < kStreamChunk ? size : kStreamChunk;
        size -= k;
        std::memcpy(child, inner.child + size, k * 4);
        std::memcpy(ray, inner.ray + size, k * 4);
        std::size_t leaf_count = 0;
        for (std::size_t i = 0; i < k; ++i) {
            if (occluded[ray[i]]) continue;
            const Node& node = nodes[child[i]];
            std::uint32_t met = 0;
            for (std::size_t v = 0; v < kVectors; ++v) {
                met |= bits_of(stream_boxes(stream, ray[i], node, v)) << (v * kLanes);
            }
            const std::uint32_t leaf = leaf_slots(node);
            size = append(node, met & ~leaf, ray[i], inner, size);
            leaf_count = append(node, met & leaf, ray[i], outer, leaf_count);
        }
        for (std::size_t i = 0; i < leaf_count; ++i) {
            const Leaf& leaf = leaves[outer.child[i] & ~kLeafBit];
            const std::uint32_t id = outer.ray[i];
            const WideShear shear(stream, id);
            std::uint32_t triangles = may_hit_triangles(rays[id], shear, leaf);
            if (triangles == 0) continue;
            const ShearedRay sheared = shear_ray(rays[id].org, rays[id].dir);
            for (; triangles != 0; triangles &= triangles - 1) {
                const auto lane = static_cast<std::uint32_t>(std::countr_zero(triangles));
                TriangleHit hit;
                if (intersect_slot(sheared, rays[id].tnear, rays[id].tfar, leaf,
                                   slot_of_lane(lane), hit)) {
                    occluded[id] = 1;
                    break;
                }
            }
        }
    }
}

void intersect_rays(const Bvh& bvh, std::span<const Ray> rays, std::span<Hit> hits) {
    for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = intersect_ray(bvh, rays[i]);
}

void occluded_rays(const Bvh& bvh, std::span<const Ray> rays, std::span<std::uint8_t> occluded) {
    for (std::size_t i = 0; i < rays.size(); i += kStreamRays) {
        const std::size_t count = rays.size() - i < kStreamRays ? rays.size() - i : kStreamRays;
        occluded_stream(bvh, rays.data() + i, count, occluded.data() + i);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
