// The closest candidates of a camera packet's rays: the leaves that they are in, and their
// triangles as vectors.
#if defined(MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_CANDIDATES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_CANDIDATES_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_CANDIDATES_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_CANDIDATES_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "cpu/packet/camera/camera_packet.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// The vertices of a leaf by axis, and the local vertex indices of its triangles.
struct LeafColumns {
    alignas(64) float values[3][kLeafVertices];
    alignas(64) std::uint32_t corners[kLeafTriangles];

    /// change(values, axis) returns what is stored for the values of some vertices.
    template <class Change>
    HWY_INLINE LeafColumns(const Leaf& leaf, Change change) {
        for (std::size_t l = 0; l < kLeafVertices; l += kLanes) {
            FloatVec v[3], w;
            hn::LoadInterleaved4(kFloats, &leaf.vertex[l].x, v[0], v[1], v[2], w);
            for (int axis = 0; axis < 3; ++axis) store(change(v[axis], axis), values[axis] + l);
            store(as_uint(w), corners + l);
        }
    }
};

/// Appends a leaf with a triangle that is, or may be, the closest candidate of a ray.
HWY_INLINE void add_hit_leaf(CameraPacket& packet, const Leaf& leaf) {
    packet.hit_leaves.emplace_back();
    HitLeaf& hit_leaf = packet.hit_leaves.back();
    hit_leaf.leaf = &leaf;
    std::memcpy(hit_leaf.prim_id, leaf.prim_id, sizeof hit_leaf.prim_id);
    const FloatVec sign =
        packet.frame.axis == kMixedAxes ? zero() : splat(packet.frame.axis_sign) & splat(-0.0f);
    const LeafColumns columns(leaf, [&](FloatVec v, int axis) HWY_ATTR {
        return (v - splat(packet.frame.org[axis])) ^ sign;
    });
    const std::uint32_t z = packet.frame.axis % kMixedAxes;
    for (std::size_t l = 0; l < kLeafTriangles; l += kLanes) {
        const UintVec own = load(columns.corners + l);
        for (std::uint32_t axis = 0; axis < 3; ++axis) {
            FloatVec at_corners[3];
            gather_corners(columns.values[(z + 1 + axis) % 3], own, at_corners);
            for (int k = 0; k < 3; ++k) store(at_corners[k], hit_leaf.corner[k][axis] + l);
        }
    }
}

/// Triangles of a leaf that one lookup of a vector reaches. A part is named by its first candidate.
constexpr std::uint32_t kPartTriangles = kLanes;
static_assert(kLeafTriangles % kPartTriangles == 0);

constexpr std::uint32_t part_of(std::uint32_t candidate) {
    return candidate & ~(kPartTriangles - 1);
}

/// As many consecutive rays as there are lanes, as bits: those with a candidate (`rays`), and those
/// whose candidate is not in the part of the first one's (`others`).
struct Candidates {
    std::uint32_t rays = 0;
    std::uint32_t part = 0;
    std::uint32_t others = 0;
};

/// Which candidates are in a part of a leaf.
HWY_INLINE Mask candidates_in_part(UintVec candidates, std::uint32_t part) {
    return float_mask((candidates & splat(~(kPartTriangles - 1))) == splat(part));
}

/// Which candidates are in a leaf.
HWY_INLINE Mask candidates_in(UintVec candidates, std::uint32_t leaf) {
    static_assert(kLeafTriangles == 16);
    return float_mask(shift_right<4>(candidates) == splat(leaf));
}

/// The leaf's triangles in these slots.
HWY_INLINE TriangleLanes triangles_in_slots(const Leaf& leaf, UintVec slots) {
    TriangleLanes out;
    const LeafColumns columns(leaf, [](FloatVec v, int) HWY_ATTR { return v; });
    const LaneLookup at_slots(slots);
    // Lookups are of floats, whatever their bits mean.
    alignas(64) float corners[kLeafTriangles], prim_ids[kLeafTriangles];
    std::memcpy(corners, columns.corners, sizeof corners);
    std::memcpy(prim_ids, leaf.prim_id, sizeof prim_ids);
    const UintVec packed = as_uint(at_slots(corners));
    for (int axis = 0; axis < 3; ++axis) {
        FloatVec at_corners[3];
        gather_corners(columns.values[axis], packed, at_corners);
        for (int k = 0; k < 3; ++k) out.corner[k][axis] = at_corners[k];
    }
    out.prim_ids = as_uint(at_slots(prim_ids));
    return out;
}

/// The triangles of as many candidates as there are lanes, in scene space. `lanes` has at least one
/// bit; the other lanes hold any value. One leaf is taken after the other, because neighbours have
/// candidates in the same ones.
HWY_INLINE TriangleLanes candidate_triangles(const CameraPacket& packet,
                                             const std::uint32_t* candidates, std::uint32_t lanes) {
    const UintVec ids = load(candidates);
    TriangleLanes out;
    for (auto& corner : out.corner) std::fill_n(corner, 3, zero());
    out.prim_ids = splat(0u);
    while (lanes != 0) {
        const std::uint32_t leaf = candidates[__builtin_ctz(lanes)] / kLeafTriangles;
        const Mask own = candidates_in(ids, leaf);
        out.take(own, triangles_in_slots(*packet.hit_leaves[leaf].leaf,
                                         ids & splat(kLeafTriangles - 1)));
        lanes &= ~bits_of(own);
    }
    return out;
}

/// Finds which of as many rays as there are lanes have candidates, and where.
HWY_INLINE Candidates find_candidates(const std::uint32_t* indices) {
    const UintVec candidates = load(indices);
    Candidates found;
    // Only kNoCandidate has its sign bit set.
    found.rays = bits_of(!float_mask(as_int(candidates) < splat(0)));
    if (found.rays == 0) return found;
    found.part = part_of(indices[__builtin_ctz(found.rays)]);
    found.others = found.rays & ~bits_of(candidates_in_part(candidates, found.part));
    return found;
}

/// Looks up values of the triangles of candidates' parts.
class PartLookup {
public:
    HWY_INLINE PartLookup(const CameraPacket& packet, UintVec candidates)
        : leaves_(packet.hit_leaves.data()),
          places_(hn::IndicesFromVec(kFloats, candidates & splat(kPartTriangles - 1))) {}

    /// Returns in each lane the triangle at its candidate's place in `part`, as in HitLeaf.
    HWY_INLINE TriangleLanes operator()(std::uint32_t part) const {
        const HitLeaf& leaf = leaves_[part / kLeafTriangles];
        const std::uint32_t first = part % kLeafTriangles;
        const auto look_up = [&](const float* values) HWY_ATTR {
            return hn::TableLookupLanes(load(values + first), places_);
        };
        TriangleLanes out;
        for (int k = 0; k < 3; ++k) {
            for (int axis = 0; axis < 3; ++axis)
                out.corner[k][axis] = look_up(leaf.corner[k][axis]);
        }
        out.prim_ids = as_uint(look_up(leaf.prim_id));
        return out;
    }

private:
    const HitLeaf* leaves_;
    decltype(hn::IndicesFromVec(kFloats, UintVec())) places_;
};

/// Collects the candidates of rays of which at least one has a candidate; the lanes of the others
/// hold some triangle. Neighbours have candidates in the same leaves, so one part is taken after
/// the other: this is faster than gathers, and than lookups in whole leaves.
HWY_INLINE TriangleLanes spread_candidates(const CameraPacket& packet, const std::uint32_t* indices,
                                           const Candidates& found) {
    const UintVec candidates = load(indices);
    const PartLookup triangles_in(packet, candidates);
    TriangleLanes out = triangles_in(found.part);
    for (std::uint32_t others = found.others; others != 0;) {
        const std::uint32_t part = part_of(indices[__builtin_ctz(others)]);
        const Mask own = candidates_in_part(candidates, part);
        out.take(own, triangles_in(part));
        others &= ~bits_of(own);
    }
    return out;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
