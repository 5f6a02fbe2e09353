// One ray against the triangles of a leaf: which of them the scalar rule has to look at.
//
// A triangle is left out if may_hit_triangle is false, by the very operations of that function, or
// if its hit would certainly lie behind the ray's origin, which is so for the triangle that a
// secondary ray starts from, the most frequent one of all.
//
// Behind the origin. Let e be the triangle's edge functions as fast_edges gives them, bound as
// there, z the vertices' z, Z the largest |z|, S the sum of the |e|, and N = sum of |e| * z. The
// rule weighs z with E, which is |e| or what exact_edges gives, so that |E - |e|| <= bound + 2^-23
// E in either case. Its weights are within 2^-20 of E / sum E (docs/arithmetic.md, "Depth"), and
// its sum of three products rounds by less than 2^-22 Z; so with all of these
//     (its z) * sum E <= sum of E * z + 2^-19 Z * sum E,
//     sum of E * z    <= N + 3 bound Z,         sum E <= S + 3 bound.
// N as computed is off by less than 2^-21 S Z. Together
//     (its z) * sum E <= N + Z * ((2^-19 + 2^-21) S + 3.01 bound),
// and the rounding of the right side has room in Z * (2^-18 S + 4 bound). If that is negative, so
// is its z. With a positive direction along z, t is then negative: no hit. With a negative
// direction the same holds for -z. N is below 2^127 for vertices within kSceneExtent and any
// origin. Products may underflow here, unlike in the rule: three in N, by 2^-126 each, and in the
// right side 2^-18 S and the product with Z, of which the first matters at most 2^-7 bound, since
// bound is at least 2 * 2^-120. So kBehindUnderflow is added.
#if defined(MORPHRAY_CPU_WIDE_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_WIDE_LEAF_INL_H
#undef MORPHRAY_CPU_WIDE_LEAF_INL_H
#else
#define MORPHRAY_CPU_WIDE_LEAF_INL_H
#endif

#include <cstddef>
#include <cstdint>

#include "common/interop/triangle.h"
#include "cpu/ray_stream-inl.h"
#include "cpu/wide_vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

HWY_INLINE vec3 leaf_position(const Leaf& leaf, std::uint32_t triangle, uint i) {
    const LeafVertex& v = leaf.vertex[corner(leaf.vertex[triangle].corners, i)];
    return {v.x, v.y, v.z};
}

#if HWY_TARGET == HWY_SCALAR

/// The triangles of the leaf that the ray may hit, as bits.
HWY_INLINE std::uint32_t possible_triangles(const RayStream& stream, std::size_t ray,
                                            const Leaf& leaf) {
    ShearedRay s;
    s.org = {stream.org[0][ray], stream.org[1][ray], stream.org[2][ray]};
    s.dir = {stream.dir[0][ray], stream.dir[1][ray], stream.dir[2][ray]};
    s.axis = stream.axis[ray];
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    std::uint32_t triangles = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        const bool may = may_hit_triangle(s, leaf_position(leaf, i, 0), leaf_position(leaf, i, 1),
                                          leaf_position(leaf, i, 2));
        triangles |= static_cast<std::uint32_t>(may) << i;
    }
    return triangles;
}

HWY_INLINE std::uint32_t slot_of_lane(std::uint32_t lane) { return lane; }

#else

// A vector load of a leaf brings kBlocks whole vertices, one to a block of 4 lanes. Four loads are
// transposed within the blocks, which is cheap on every target, so slots are not in order: lane i
// of vector v holds slot kLanes * v + kBlocks * (i % 4) + i / 4. For triangles likewise, because
// their corners stand in the vertices.
inline constexpr std::uint32_t kBlocks = kLanes / 4;

/// The slot of bit `lane` of possible_triangles.
HWY_INLINE std::uint32_t slot_of_lane(std::uint32_t lane) {
    const std::uint32_t i = lane % kLanes;
    return lane - i + kBlocks * (i % 4) + i / 4;
}

/// slot_of_lane for vector v.
HWY_INLINE UintVec slots_of_vector(std::size_t v) {
    const UintVec lane = hn::Iota(kUints, 0u);
    const UintVec in_block = hn::And(lane, hn::Set(kUints, 3u));
    const UintVec block = hn::ShiftRight<2>(lane);
    return hn::Add(hn::Add(hn::Mul(in_block, hn::Set(kUints, kBlocks)), block),
                   hn::Set(kUints, static_cast<std::uint32_t>(v * kLanes)));
}

/// For each axis, which bytes of a vertex (x, y, z, corners) rotate_axes makes x, y and z.
alignas(16) inline constexpr std::uint8_t kRotations[3][16] = {
    {4, 5, 6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 12, 13, 14, 15},
    {8, 9, 10, 11, 0, 1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 15},
    {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15},
};

/// The vertices of a leaf with rotated axes, and the corners of its triangles.
struct LeafLanes {
    FloatVec x[kVectors];
    FloatVec y[kVectors];
    FloatVec z[kVectors];
    UintVec corners[kVectors];
};

HWY_INLINE LeafLanes load_leaf(const Leaf& leaf, std::uint32_t axis) {
    using PairTag = hn::Repartition<std::uint64_t, FloatTag>;
    using PairVec = hn::Vec<PairTag>;
    constexpr PairTag kPairs;
    const auto rotation = hn::LoadDup128(kBytes, kRotations[axis]);
    const auto lower = [](FloatVec a, FloatVec b) {
        return hn::BitCast(PairTag(), hn::InterleaveLower(kFloats, a, b));
    };
    const auto upper = [](FloatVec a, FloatVec b) {
        return hn::BitCast(PairTag(), hn::InterleaveUpper(kFloats, a, b));
    };
    LeafLanes lanes;
    for (std::size_t v = 0; v < kVectors; ++v) {
        FloatVec row[4];
        for (std::size_t i = 0; i < 4; ++i) {
            const float* vertices = &leaf.vertex[v * kLanes + i * kBlocks].x;
            const auto bytes = hn::BitCast(kBytes, hn::LoadU(kFloats, vertices));
            row[i] = hn::BitCast(kFloats, hn::TableLookupBytes(bytes, rotation));
        }
        const PairVec xy01 = lower(row[0], row[1]);
        const PairVec xy23 = lower(row[2], row[3]);
        const PairVec zc01 = upper(row[0], row[1]);
        const PairVec zc23 = upper(row[2], row[3]);
        lanes.x[v] = hn::BitCast(kFloats, hn::InterleaveLower(kPairs, xy01, xy23));
        lanes.y[v] = hn::BitCast(kFloats, hn::InterleaveUpper(kPairs, xy01, xy23));
        lanes.z[v] = hn::BitCast(kFloats, hn::InterleaveLower(kPairs, zc01, zc23));
        lanes.corners[v] = hn::BitCast(kUints, hn::InterleaveUpper(kPairs, zc01, zc23));
    }
    return lanes;
}

/// A value for each vertex slot: in vectors, or in memory where permuting those does not pay.
class VertexValues {
public:
    HWY_INLINE void set(std::size_t v, FloatVec values) {
        if constexpr (kVectors <= 2) {
            vectors_[v] = values;
        } else {
            hn::Store(values, kFloats, table_ + v * kLanes);
        }
    }
    HWY_INLINE FloatVec vector(std::size_t v) const { return vectors_[v]; }
    HWY_INLINE const float* table() const { return table_; }

private:
    FloatVec vectors_[kVectors];
    HWY_ALIGN float table_[kLeafVertices];
};

/// The leaf's vertices as project_fast gives them, and their |x| + |y|.
struct ProjectedLeaf {
    VertexValues x;
    VertexValues y;
    VertexValues z;
    VertexValues size;
};

HWY_INLINE ProjectedLeaf project_leaf(const RayStream& stream, std::size_t ray,
                                      const LeafLanes& lanes) {
    const FloatVec dx = broadcast(stream.dir[0][ray]);
    const FloatVec dy = broadcast(stream.dir[1][ray]);
    const FloatVec dz = broadcast(stream.dir[2][ray]);
    const FloatVec snap = broadcast(kProjectedSnap);
    ProjectedLeaf points;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const FloatVec ax = hn::Sub(lanes.x[v], broadcast(stream.org[0][ray]));
        const FloatVec ay = hn::Sub(lanes.y[v], broadcast(stream.org[1][ray]));
        const FloatVec az = hn::Sub(lanes.z[v], broadcast(stream.org[2][ray]));
        const FloatVec x = hn::Sub(hn::Add(difference(ax, dz, dx, az), snap), snap);
        const FloatVec y = hn::Sub(hn::Add(difference(ay, dz, dy, az), snap), snap);
        points.x.set(v, x);
        points.y.set(v, y);
        points.z.set(v, az);
        points.size.set(v, hn::Add(hn::Abs(x), hn::Abs(y)));
    }
    return points;
}

/// Takes the values that a vector of triangles has at one corner.
class CornerGather {
public:
    HWY_INLINE CornerGather(UintVec corners, int i)
        : slot_(hn::And(hn::ShiftRightSame(corners, 8 * i), hn::Set(kUints, kLeafVertices - 1))) {}

    HWY_INLINE FloatVec operator()(const VertexValues& values) const {
        if constexpr (kVectors == 1) {
            return hn::TableLookupLanes(values.vector(0), hn::IndicesFromVec(kFloats, lane()));
        } else if constexpr (kVectors == 2) {
            const auto lanes = hn::IndicesFromVec(kFloats, lane());
            const FloatVec in_second = hn::BitCast(kFloats, hn::ShiftLeft<28>(slot_));
            return hn::IfNegativeThenElse(in_second, hn::TableLookupLanes(values.vector(1), lanes),
                                          hn::TableLookupLanes(values.vector(0), lanes));
        } else {
            return hn::GatherIndex(kFloats, values.table(), hn::BitCast(kInts, slot_));
        }
    }

private:
    /// Where in its vector a slot is: the inverse of slot_of_lane.
    HWY_INLINE UintVec lane() const {
        constexpr int kBlockBits = kVectors == 1 ? 2 : 1;
        const UintVec block = hn::And(slot_, hn::Set(kUints, kBlocks - 1));
        const UintVec in_block = hn::And(hn::ShiftRight<kBlockBits>(slot_), hn::Set(kUints, 3u));
        return hn::Or(hn::ShiftLeft<2>(block), in_block);
    }

    UintVec slot_;
};

// Of S in the proof above: 2^-18.
inline constexpr float kBehindError = 3.814697265625e-06f;
// More than what underflow takes from the products there: 2^-120.
inline constexpr float kBehindUnderflow = 0x1p-120f;

/// The triangles of the leaf that the ray may hit, as bits: bit i is for slot slot_of_lane(i).
HWY_INLINE std::uint32_t possible_triangles(const RayStream& stream, std::size_t ray,
                                            const Leaf& leaf) {
    const LeafLanes lanes = load_leaf(leaf, stream.axis[ray]);
    const ProjectedLeaf points = project_leaf(stream, ray, lanes);
    const FloatVec away = hn::And(broadcast(stream.dir[2][ray]), broadcast(-0.0f));
    std::uint32_t triangles = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const CornerGather a(lanes.corners[v], 0);
        const CornerGather b(lanes.corners[v], 1);
        const CornerGather c(lanes.corners[v], 2);
        const FloatVec ax = a(points.x), ay = a(points.y), az = a(points.z);
        const FloatVec bx = b(points.x), by = b(points.y), bz = b(points.z);
        const FloatVec cx = c(points.x), cy = c(points.y), cz = c(points.z);
        const FloatVec m = sum3(a(points.size), b(points.size), c(points.size));
        const FloatVec z = max3(hn::Abs(az), hn::Abs(bz), hn::Abs(cz));
        const FloatVec r =
            hn::Add(hn::Mul(broadcast(kFastProjectionError), hn::Add(hn::Add(m, m), z)),
                    broadcast(kFastProjectionFloor));
        const FloatVec bound = hn::Mul(r, hn::Add(m, hn::Add(r, r)));
        const FloatVec eu = difference(bx, cy, by, cx);
        const FloatVec ev = difference(cx, ay, cy, ax);
        const FloatVec ew = difference(ax, by, ay, bx);
        const FloatMask inside =
            hn::Or(hn::Ge(min3(eu, ev, ew), hn::Neg(bound)), hn::Le(max3(eu, ev, ew), bound));
        const FloatVec au = hn::Abs(eu), av = hn::Abs(ev), aw = hn::Abs(ew);
        // Fused or not: this decides no hit.
        const FloatVec n = hn::MulAdd(aw, cz, hn::MulAdd(av, bz, hn::Mul(au, az)));
        const FloatVec error =
            hn::MulAdd(broadcast(kBehindError), sum3(au, av, aw), hn::Mul(broadcast(4.0f), bound));
        const FloatVec slack = hn::MulAdd(z, error, broadcast(kBehindUnderflow));
        const FloatMask ahead = hn::Ge(hn::Xor(n, away), hn::Neg(slack));
        const auto used = hn::Lt(slots_of_vector(v), hn::ShiftRight<24>(lanes.corners[v]));
        triangles |= bits_of(hn::And(hn::And(inside, ahead), hn::RebindMask(kFloats, used)))
                     << (v * kLanes);
    }
    return triangles;
}

#endif  // HWY_TARGET

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
