// A leaf in vectors whose lanes are its 16 vertices, and then its 16 triangles.
#if defined(MORPHRAY_CPU_SINGLE_RAY_LEAF_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_LEAF_LANES_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_LEAF_LANES_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_LEAF_LANES_INL_H
#endif

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "common/interop/packet_bounds.h"
#include "common/simd/vectors-inl.h"
#include "cpu/simd/lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

HWY_INLINE vec3 leaf_position(const Leaf& leaf, std::uint32_t triangle, uint i) {
    const LeafVertex& v = leaf.vertex[corner(leaf.vertex[triangle].corners, i)];
    return {v.x, v.y, v.z};
}

/// Whether two corners of a triangle are at one place, bit for bit: no ray hits it
/// (docs/design/arithmetic.md, "No area"), but all edge functions may be 0, which only the exact
/// path can tell from a hit.
HWY_INLINE bool has_equal_corners(const Leaf& leaf, std::uint32_t triangle) {
    const vec3 a = leaf_position(leaf, triangle, 0);
    const vec3 b = leaf_position(leaf, triangle, 1);
    const vec3 c = leaf_position(leaf, triangle, 2);
    const auto are_equal = [](const vec3& p, const vec3& q) {
        return std::memcmp(&p, &q, sizeof p) == 0;
    };
    return are_equal(a, b) || are_equal(b, c) || are_equal(c, a);
}

#if HWY_TARGET != HWY_SCALAR

// A vector load of a leaf brings kBlocks whole vertices, one to a block of 4 lanes. Four loads are
// transposed within the blocks, which is cheap on every target, so slots are not in order: lane i
// of vector v holds slot kLanes * v + kBlocks * (i % 4) + i / 4. Triangles have the same order,
// because their local vertex indices are stored with the vertices.
inline constexpr std::uint32_t kBlocks = kLanes / 4;

/// The slot of lane i of vector v, for lane = v * kLanes + i.
constexpr std::uint32_t slot_of_lane(std::uint32_t lane) {
    const std::uint32_t i = lane % kLanes;
    return lane - i + kBlocks * (i % 4) + i / 4;
}

/// Its inverse.
alignas(16) inline constexpr auto kLaneOfSlot = [] {
    std::array<std::uint8_t, kLeafVertices> lanes{};
    for (std::uint8_t lane = 0; lane < kLeafVertices; ++lane) lanes[slot_of_lane(lane)] = lane;
    return lanes;
}();

/// slot_of_lane for vector v.
HWY_INLINE UintVec slots_of_vector(std::size_t v) {
    const UintVec lane = hn::Iota(kUints, 0u);
    const UintVec in_block = lane & splat(3u);
    const UintVec block = shift_right<2>(lane);
    return in_block * splat(kBlocks) + block + splat(static_cast<std::uint32_t>(v * kLanes));
}

/// For each axis, the bytes of a vertex (x, y, z, local vertex indices) in the order of
/// rotate_axes.
alignas(16) inline constexpr std::uint8_t kRotations[3][16] = {
    {4, 5, 6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 12, 13, 14, 15},
    {8, 9, 10, 11, 0, 1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 15},
    {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15},
};

/// The vertices of a leaf with rotated axes, and the local vertex indices of its triangles.
struct LeafLanes {
    FloatVec x[kVectors];
    FloatVec y[kVectors];
    FloatVec z[kVectors];
    UintVec local_vertices[kVectors];
};

/// Loads a leaf for rays with this main axis; kAxis is the same, or kAnyAxis.
template <int kAxis>
HWY_INLINE LeafLanes load_leaf(const Leaf& leaf, std::uint32_t axis) {
    const auto rotation = hn::LoadDup128(kBytes, kRotations[axis]);
    LeafLanes out;
    for (std::size_t v = 0; v < kVectors; ++v) {
        FloatVec row[4];
        for (std::size_t i = 0; i < 4; ++i) {
            const float* vertices = &leaf.vertex[v * kLanes + i * kBlocks].x;
            const auto bytes = hn::BitCast(kBytes, load_unaligned(vertices));
            row[i] = as_float(kAxis == kAnyAxis ? hn::TableLookupBytes(bytes, rotation) : bytes);
        }
        FloatVec column[4];
        transpose_fours(kFloats, row, column);
        out.x[v] = column[kAxis == kAnyAxis ? 0 : (kAxis + 1) % 3];
        out.y[v] = column[kAxis == kAnyAxis ? 1 : (kAxis + 2) % 3];
        out.z[v] = column[kAxis == kAnyAxis ? 2 : kAxis];
        out.local_vertices[v] = as_uint(column[3]);
    }
    return out;
}

/// A value for each vertex slot: in vectors, or in memory where permuting those does not pay.
class VertexValues {
public:
    HWY_INLINE void set(std::size_t v, FloatVec values) {
        if constexpr (kVectors <= 2) {
            vectors_[v] = values;
        } else {
            store(values, table_ + v * kLanes);
        }
    }
    HWY_INLINE FloatVec look_up(const LaneLookup& places) const { return places(vectors_, table_); }

private:
    FloatVec vectors_[kVectors];
    HWY_ALIGN float table_[kLeafVertices];
};

/// Looks up values for the three vertices of a vector of triangles.
struct VertexLookups {
    LaneLookup a;
    LaneLookup b;
    LaneLookup c;

    HWY_INLINE explicit VertexLookups(UintVec local_vertices)
        : VertexLookups(places_of(local_vertices), 0) {}

private:
    HWY_INLINE VertexLookups(UintVec places, int)
        : a(places & splat(15u)),
          b(shift_right<8>(places) & splat(15u)),
          c(shift_right<16>(places) & splat(15u)) {}

    /// The places in VertexValues of the slots in the bytes.
    HWY_INLINE static UintVec places_of(UintVec slots) {
        if constexpr (kVectors > 2) return slots;
        const auto places = hn::LoadDup128(kBytes, kLaneOfSlot.data());
        return hn::BitCast(kUints, hn::TableLookupBytes(places, hn::BitCast(kBytes, slots)));
    }
};

/// has_equal_corners() of a vector of triangles.
HWY_INLINE Mask equal_corners(const LeafLanes& vertices, const VertexLookups& at) {
    const auto equal = [](FloatVec p, FloatVec q)
                           HWY_ATTR { return float_mask(as_uint(p) == as_uint(q)); };
    Mask ab = equal(zero(), zero()), bc = ab, ca = ab;
    for (const FloatVec* values : {vertices.x, vertices.y, vertices.z}) {
        VertexValues corners;
        for (std::size_t v = 0; v < kVectors; ++v) corners.set(v, values[v]);
        const FloatVec a = corners.look_up(at.a);
        const FloatVec b = corners.look_up(at.b);
        const FloatVec c = corners.look_up(at.c);
        ab = ab & equal(a, b);
        bc = bc & equal(b, c);
        ca = ca & equal(c, a);
    }
    return ab | bc | ca;
}

#endif  // HWY_TARGET

// Tests by plain edge functions and depths that are certain, so that the hit rule need not be
// asked: a triangle occludes a ray, with a hit between tnear and tfar; a hit would lie behind the
// origin; a hit would lie beyond tfar.
//
// Occluders. Names (lab/proofs/certain.g; e = 2^-24): E the magnitudes of the exact edge functions,
// z the vertices' z by the sign of dir.z, Z the largest |z|, zbar the mean of z under E. |e| are
// the magnitudes of plain edge functions with |E - |e|| <= bound, all in units of dir.z^2 for
// slopes; s the sum of the |e|, n the sum of |e| z; X = max(kSceneExtent, |org|), so Z <= 2.001 X.
// 1. All e are beyond the bound and have one sign. So have the exact ones, and none is 0: the ray
//    goes through the triangle, whichever path of the rule decides.
// 2. n / s is within (2 bound range) / s, at most 4 bound Z / s, of zbar, as the deviations from a
//    mean add up to at most 2 range (docs/design/arithmetic.md, "Depth").
// 3. The exact path's z is within 6.32 e (range + Z), at most 19 e Z, of zbar. The fast path's is
//    off by 2 B range / S more, with B and S those of the rule's own functions.
// 4. The test demands from s <= n and kCertainBound bound Z <= n - from s (and the same up to
//    `to`). |n| <= s Z, so bound / s <= 1 / kCertainBound but for rounding.
// 5. The rule's own functions are the |e|, or, where these are of slopes, the same in other
//    operations: with M the largest |x'| + |y'| and r of edge_bound for the leaf, s <= 3 M^2, so
//    step 4 makes M at least 32 r. Coordinates of both kinds differ by 2 (8 e (X + Z) + 5 e X), so
//    the sum of all six by an eighth of 3 M at most, and B by less than a factor of 2: B <= 2
//    bound, S >= s - 3 bound - 3 B >= s - 9 bound >= 0.71 s. So 2 B range / S is at most
//    8 bound Z / (0.71 s).
// 6. A hit needs a z beyond 2 B range / S + 8 e range + 8 e Z, at most 11.3 bound Z / s + 24.1 e Z.
// 7. Together bound / s has 4 + 2 * 11.3 < kCertainBound of Z. The rest is at most 126 e X: 6.3 e Z
//    of the roundings of n, s and the test, 19 e Z of step 3, 24.1 e Z of step 6, 3.4 e Z of t = z
//    rcp(dir.z), and 5 roundings of `to`, which is up to 4 X.
// 8. kCertainDepth X = 256 e X covers this and 2^-17 X on top: t could move by 2^-18 of X and a hit
//    would be in range all the same.
// 9. Nothing overflows: origins farther than kCertainOrigin have no certain occluders, so from and
//    to are at most 2^32. Products that underflow are off by 2^-124 in all; s is at least 3 bound,
//    from at least 2^4, so e from s is at least 2^-116.
//
// A vertex that is not finite is left to the caller.
//
// Beyond tfar (certainly_beyond). The test demands kCertainBound bound <= s and
// beyond s + kBeyondBound bound R <= n, with R the range of z, and beyond tfar |dir.z| with
// kBeyondDepth X added. Most of these triangles are those at which shadow rays end.
// 1. Steps 2, 3 and 5 hold for every triangle that the rule finds hit: they need no e beyond the
//    bound, and bound / s is at most 1 / kCertainBound.
// 2. n / s is within 2 bound R / s of zbar. The fast path is off by 2 B R / S, where step 5 makes B
//    at most 1.27 bound and S at least s - 3 bound - 3 B. kBeyondBound covers both.
// 3. kBeyondDepth X = 128 e X covers what is left but for step 6, which only makes hits fewer: 119
//    e X. So t of a hit would exceed tfar.
// 4. Where tfar |dir.z| is more than 4 X, no n / s is: beyond is capped there, and kHugeReciprocal
//    for origins farther than kCertainOrigin.
//
// Behind the origin (may_be_ahead; lab/proofs/near.g). Names as above.
// 1. |E - |e|| <= bound for each of the three.
// 2. A hit has a z of certain sign (docs/design/arithmetic.md, "In front"), so the sum of E z is
//    positive.
// 3. By step 1, the sum of E z is at most n + 3 bound Z.
// 4. n as computed is off by at most 3 e s Z. It is below 2^127 for vertices within kSceneExtent
//    and any origin.
// 5. So a ray misses if n + Z (kBehindError s + 4 bound) is negative.
// 6. Unlike in the rule, products may underflow: three in n, by 2^-126 each, and kBehindError s and
//    the product with Z in step 5. kBehindError s does not matter to a bound of at least 2^-97;
//    kBehindUnderflow is added for the others.

/// n, by the sign of dir.z, and s of plain edge functions.
struct DepthSum {
    FloatVec n;
    FloatVec s;
};

/// Fused or not: this decides no hit without a bound.
HWY_INLINE DepthSum depth_sum(const lanes::Edges& e, FloatVec za, FloatVec zb, FloatVec zc,
                              FloatVec dz) {
    const FloatVec au = abs(e.u), av = abs(e.v), aw = abs(e.w);
    const FloatVec n = mul_add(aw, zc, mul_add(av, zb, au * za));
    return {n ^ (dz & splat(-0.0f)), sum3(au, av, aw)};
}

/// The range of z in which a hit is certain, by the sign of dir.z, and where hits beyond tfar
/// begin.
struct CertainRange {
    FloatVec from;
    FloatVec to;
    FloatVec beyond;
};

/// Loads the ranges of the rays from `first` on.
HWY_INLINE CertainRange certain_ranges(const RayStream& stream, std::size_t first) {
    return {load(stream.certain_from + first), load(stream.certain_to + first),
            load(stream.certain_beyond + first)};
}

/// Loads the range of one ray into all lanes.
HWY_INLINE CertainRange certain_range(const RayStream& stream, std::size_t ray) {
    return {splat(stream.certain_from[ray]), splat(stream.certain_to[ray]),
            splat(stream.certain_beyond[ray])};
}

/// The lanes in which the rule certainly finds a hit, if the vertices are finite. Of e it takes u,
/// v, w, bound and depth_size, which may be those of a whole leaf.
HWY_INLINE Mask certain_occluders(const lanes::Edges& e, const DepthSum& depth,
                                  const CertainRange& range) {
    const Mask inside = (min3(e.u, e.v, e.w) > e.bound) | (max3(e.u, e.v, e.w) < -e.bound);
    const FloatVec slack = kCertainBound * e.bound * e.depth_size;
    return inside & (neg_mul_add(range.from, depth.s, depth.n) >= slack) &
           (mul_sub(range.to, depth.s, depth.n) >= slack);
}

/// The lanes whose triangle is hit beyond tfar, if at all. Of e it takes bound, as above, and
/// depth_range.
HWY_INLINE Mask certainly_beyond(const lanes::Edges& e, const DepthSum& depth,
                                 const CertainRange& range) {
    const FloatVec slack = kBeyondBound * e.bound * e.depth_range;
    return (neg_mul_add(range.beyond, depth.s, depth.n) >= slack) &
           (depth.s >= kCertainBound * e.bound);
}

// More than what underflow takes from the products: 2^-120.
inline constexpr float kBehindUnderflow = 0x1p-120f;

/// False in lanes whose triangle would be hit behind the origin only. Of e it takes bound and
/// depth_size, as above.
HWY_INLINE Mask may_be_ahead(const lanes::Edges& e, const DepthSum& depth) {
    const FloatVec error = mul_add(splat(kBehindError), depth.s, 4.0f * e.bound);
    const FloatVec slack = mul_add(e.depth_size, error, splat(kBehindUnderflow));
    return depth.n >= -slack;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
