// A leaf in vectors whose lanes are its 16 vertices, and then its 16 triangles.
#if defined(MORPHRAY_CPU_SINGLE_RAY_LEAF_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_LEAF_LANES_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_LEAF_LANES_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_LEAF_LANES_INL_H
#endif

#include <cstddef>
#include <cstdint>

#include "cpu/simd/wide_vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

HWY_INLINE vec3 leaf_position(const Leaf& leaf, std::uint32_t triangle, uint i) {
    const LeafVertex& v = leaf.vertex[corner(leaf.vertex[triangle].corners, i)];
    return {v.x, v.y, v.z};
}

#if HWY_TARGET != HWY_SCALAR

// A vector load of a leaf brings kBlocks whole vertices, one to a block of 4 lanes. Four loads are
// transposed within the blocks, which is cheap on every target, so slots are not in order: lane i
// of vector v holds slot kLanes * v + kBlocks * (i % 4) + i / 4. For triangles likewise, because
// their corners stand in the vertices.
inline constexpr std::uint32_t kBlocks = kLanes / 4;

/// The slot of lane i of vector v, for lane = v * kLanes + i.
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

/// Takes the values that a vector of triangles has at one corner.
class CornerGather {
public:
    HWY_INLINE explicit CornerGather(UintVec places)
        : places_(hn::And(places, hn::Set(kUints, kLeafVertices - 1))) {}

    HWY_INLINE FloatVec operator()(const VertexValues& values) const {
        if constexpr (kVectors == 1) {
            return hn::TableLookupLanes(values.vector(0), hn::IndicesFromVec(kFloats, places_));
        } else if constexpr (kVectors == 2) {
            const auto lanes =
                hn::IndicesFromVec(kFloats, hn::And(places_, hn::Set(kUints, kLanes - 1)));
            const FloatVec in_second = hn::BitCast(kFloats, hn::ShiftLeft<28>(places_));
            return hn::IfNegativeThenElse(in_second, hn::TableLookupLanes(values.vector(1), lanes),
                                          hn::TableLookupLanes(values.vector(0), lanes));
        } else {
            return hn::GatherIndex(kFloats, values.table(), hn::BitCast(kInts, places_));
        }
    }

private:
    UintVec places_;
};

/// For the three corners of a vector of triangles.
struct CornerGathers {
    CornerGather a;
    CornerGather b;
    CornerGather c;

    HWY_INLINE explicit CornerGathers(UintVec corners) : CornerGathers(places_of(corners), 0) {}

private:
    HWY_INLINE CornerGathers(UintVec places, int)
        : a(places), b(hn::ShiftRight<8>(places)), c(hn::ShiftRight<16>(places)) {}

    /// Where VertexValues has the slots in the bytes of `corners`: the inverse of slot_of_lane, for
    /// all bytes at once.
    HWY_INLINE static UintVec places_of(UintVec corners) {
        if constexpr (kVectors > 2) return corners;
        constexpr std::uint32_t kBytesOfOne = 0x01010101;
        constexpr int kBlockBits = kVectors == 1 ? 2 : 1;
        constexpr std::uint32_t kVectorBits = kVectors == 1 ? 0 : kLanes;
        const auto bits = [](UintVec v, std::uint32_t mask) {
            return hn::And(v, hn::Set(kUints, mask * kBytesOfOne));
        };
        const UintVec block = hn::ShiftLeft<2>(bits(corners, kBlocks - 1));
        const UintVec in_block = bits(hn::ShiftRight<kBlockBits>(corners), 3);
        return hn::Or(hn::Or(block, in_block), bits(corners, kVectorBits));
    }
};

#endif  // HWY_TARGET

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
