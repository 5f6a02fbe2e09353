// A leaf in vectors whose lanes are its 16 vertices, and then its 16 triangles.
#if defined(MORPHRAY_CPU_SINGLE_RAY_LEAF_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_LEAF_LANES_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_LEAF_LANES_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_LEAF_LANES_INL_H
#endif

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "common/simd/vectors-inl.h"
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
HWY_INLINE std::uint32_t slot_of_lane(std::uint32_t lane) {
    const std::uint32_t i = lane % kLanes;
    return lane - i + kBlocks * (i % 4) + i / 4;
}

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

    /// The places in VertexValues of the slots in the bytes: the inverse of slot_of_lane, for all
    /// bytes at once.
    HWY_INLINE static UintVec places_of(UintVec slots) {
        if constexpr (kVectors > 2) return slots;
        constexpr std::uint32_t kBytesOfOne = 0x01010101;
        constexpr int kBlockBits = kVectors == 1 ? 2 : 1;
        constexpr std::uint32_t kVectorBits = kVectors == 1 ? 0 : kLanes;
        const auto bits = [](UintVec v, std::uint32_t mask) {
            return v & splat(mask * kBytesOfOne);
        };
        const UintVec block = shift_left<2>(bits(slots, kBlocks - 1));
        const UintVec in_block = bits(shift_right<kBlockBits>(slots), 3);
        return block | in_block | bits(slots, kVectorBits);
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

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
