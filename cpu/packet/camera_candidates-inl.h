// The closest candidates of a camera packet's rays: directions of rays; leaves with candidates,
// which are kept until the packet is finished; candidates as vectors of triangles; and rays whose
// bounds leave the closest hit uncertain, which are deferred and resolved by the hit rule.
#if defined(MORPHRAY_CPU_PACKET_CAMERA_CANDIDATES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_CANDIDATES_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_CANDIDATES_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_CANDIDATES_INL_H
#endif

#include <algorithm>

#include "common/interop/packet_bounds.h"
#include "cpu/packet/packets.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// ---- Directions

HWY_INLINE lanes::Float3 directions_of(const CameraPacket& packet, UintVec rays) {
    if (packet.stored != nullptr) {
        const auto at = [&](int axis) HWY_ATTR {
            return hn::GatherIndex(kFloats, packet.stored->d[axis], as_int(rays));
        };
        return {at(0), at(1), at(2)};
    }
    const auto low = [](UintVec bits) HWY_ATTR { return bits & splat(3u); };
    static_assert(kBlockSide == 4 && kGridSide == 16);
    const UintVec blocks = shift_right<4>(rays);
    const UintVec columns = blocks & splat(15u);
    const UintVec x = shift_left<2>(columns) | low(shift_right<2>(rays));
    const UintVec y = shift_left<2>(shift_right<4>(blocks)) | low(rays);
    return lanes::canonical_direction(lanes::camera_direction(
        packet.camera, x + splat(packet.first_x), y + splat(packet.first_y)));
}

// ---- Leaves

/// The vertices of a leaf by axis, and the local vertex indices of its triangles.
struct LeafColumns {
    alignas(64) PerVertex<float> values[3];
    alignas(64) PerTriangle<std::uint32_t> corners;

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

// ---- Candidates

/// A chunk is the triangles of a leaf that one lookup of a vector reaches. Its number is that of
/// its first candidate.
constexpr std::uint32_t kChunkTriangles = kLanes;
static_assert(kLeafTriangles % kChunkTriangles == 0);

constexpr std::uint32_t chunk_of(std::uint32_t candidate) {
    return candidate & ~(kChunkTriangles - 1);
}

/// As many consecutive rays as there are lanes, as bits: those with a candidate (`rays`), and those
/// whose candidate is not in the chunk of the first one's (`others`).
struct Candidates {
    std::uint32_t rays = 0;
    std::uint32_t chunk = 0;
    std::uint32_t others = 0;
};

HWY_INLINE Mask candidates_in_chunk(UintVec candidates, std::uint32_t chunk) {
    return float_mask((candidates & splat(~(kChunkTriangles - 1))) == splat(chunk));
}

/// The triangles of as many candidates as there are lanes, in scene space; only those of `lanes`.
HWY_INLINE TriangleLanes candidate_triangles(const CameraPacket& packet,
                                             const std::uint32_t* candidates, std::uint32_t lanes) {
    alignas(64) float corner[3][3][kLanes] = {};
    alignas(64) std::uint32_t prim_ids[kLanes] = {};
    for (const std::uint32_t lane : BitsOf(lanes)) {
        const Leaf& leaf = *packet.hit_leaves[triangle_leaf(candidates[lane])].leaf;
        const std::uint32_t slot = triangle_slot(candidates[lane]);
        for (int k = 0; k < 3; ++k) {
            const vec3 p = leaf_position(leaf, slot, static_cast<uint>(k));
            for (int axis = 0; axis < 3; ++axis) corner[k][axis][lane] = p[axis];
        }
        prim_ids[lane] = leaf.prim_id[slot];
    }
    TriangleLanes out;
    for (int k = 0; k < 3; ++k)
        for (int axis = 0; axis < 3; ++axis) out.corner[k][axis] = load(corner[k][axis]);
    out.prim_ids = load(prim_ids);
    return out;
}

HWY_INLINE Candidates find_candidates(const std::uint32_t* indices) {
    const UintVec candidates = load(indices);
    Candidates found;
    // Only kNoCandidate has its sign bit set.
    found.rays = bits_of(!float_mask(as_int(candidates) < splat(0)));
    if (found.rays == 0) return found;
    found.chunk = chunk_of(indices[first_bit(found.rays)]);
    found.others = found.rays & ~bits_of(candidates_in_chunk(candidates, found.chunk));
    return found;
}

/// Collects the candidates of rays of which at least one has a candidate; the lanes of the others
/// hold some triangle. Neighbours have candidates in the same leaves, so one chunk is taken after
/// the other: this is faster than gathers, and than lookups in whole leaves.
HWY_INLINE TriangleLanes spread_candidates(const CameraPacket& packet, const std::uint32_t* indices,
                                           const Candidates& found) {
    const UintVec candidates = load(indices);
    const auto places = hn::IndicesFromVec(kFloats, candidates & splat(kChunkTriangles - 1));
    const auto triangles_in = [&](std::uint32_t chunk) HWY_ATTR {
        const HitLeaf& leaf = packet.hit_leaves[triangle_leaf(chunk)];
        const auto look_up = [&](const float* values) HWY_ATTR {
            return hn::TableLookupLanes(load(values + triangle_slot(chunk)), places);
        };
        TriangleLanes in_chunk;
        for (int k = 0; k < 3; ++k) {
            for (int axis = 0; axis < 3; ++axis)
                in_chunk.corner[k][axis] = look_up(leaf.corner[k][axis]);
        }
        in_chunk.prim_ids = as_uint(look_up(leaf.prim_id));
        return in_chunk;
    };
    TriangleLanes out = triangles_in(found.chunk);
    for (std::uint32_t others = found.others; others != 0;) {
        const std::uint32_t chunk = chunk_of(indices[first_bit(others)]);
        const Mask own = candidates_in_chunk(candidates, chunk);
        out.take(own, triangles_in(chunk));
        others &= ~bits_of(own);
    }
    return out;
}

// ---- Deferred rays

/// Deferred pairs of a ray and a triangle that may be its closest hit. Until the rule has said
/// where an uncertain triangle is hit, it neither displaces a candidate nor is displaced. The
/// result does not change: it is the least of all triangles in the rule's order, and each triangle
/// that was rejected for certain is farther than one that is hit for certain.
class DeferredRays {
public:
    explicit DeferredRays(CameraPacket& packet) : packet_(packet) {}

    /// Defers the rays `lanes` from `first` on with a triangle, given as a candidate. Requires
    /// !many().
    void add(std::size_t first, std::uint32_t lanes, std::uint32_t triangle) {
        for (const std::uint32_t lane : BitsOf(lanes)) {
            rays_[count_] = static_cast<std::uint32_t>(first) + lane;
            triangles_[count_++] = triangle;
        }
    }

    bool many() const { return count_ >= kMany; }

    /// Resolves all deferred pairs by the rule. Adds to `changed` the blocks whose rays have new
    /// candidates.
    void resolve(BlockSet& changed) {
        for (std::size_t first = 0; first < count_; first += kLanes) {
            Batch batch;
            apply_rule(first, std::min<std::size_t>(kLanes, count_ - first), batch);
            take_closest(batch, changed);
        }
        count_ = 0;
    }

private:
    static constexpr std::size_t kMany = 128;

    /// How far 1 / (t z) as computed here may be from that of the rule's hit, relative to it
    /// (lab/proofs/packet_rays.g). An error of e of z is at most 2 e of 1 / z up to e = 1/2.
    static float hit_depth_error(const PacketFrame& frame) {
        const float z_error = kHitDotRounding * frame.row_size[2] * frame.depth_most;
        return z_error < 0.5f ? 2 * (kHitDepthRounding + z_error) : kUnknown;
    }

    /// As many pairs as there are lanes, and what the rule says of them.
    struct Batch {
        alignas(64) std::uint32_t rays[kLanes] = {};
        alignas(64) std::uint32_t triangles[kLanes] = {};
        alignas(64) std::uint32_t candidates[kLanes] = {};
        alignas(64) float t[kLanes], best_t[kLanes], q[kLanes];
        alignas(64) std::uint32_t ids[kLanes], best_ids[kLanes];
        /// The pairs that hit, and the ones whose ray has another candidate.
        std::uint32_t hits, rivals;
    };

    void apply_rule(std::size_t first, std::size_t count, Batch& batch) const {
        for (std::size_t l = 0; l < count; ++l) {
            batch.rays[l] = rays_[first + l];
            batch.triangles[l] = triangles_[first + l];
            batch.candidates[l] = packet_.candidate[batch.rays[l]];
        }
        const lanes::Float3 dir = directions_of(packet_, load(batch.rays));
        const lanes::ShearedRay rays = lanes::shear_ray(lanes::Float3(packet_.frame.org), dir);
        const auto lanes = static_cast<std::uint32_t>((std::uint64_t{1} << count) - 1);
        const TriangleLanes triangles = candidate_triangles(packet_, batch.triangles, lanes);
        const FloatVec no_end = splat(kInfiniteT);
        lanes::TriangleHit hit;
        batch.hits = bits_of(intersect_triangles(rays, triangles, no_end, lanes, hit));
        const UintVec none = splat(kNoCandidate);
        batch.rivals = batch.hits & bits_of(float_mask(load(batch.candidates) != none));
        if (batch.rivals != 0) {
            const TriangleLanes best = candidate_triangles(packet_, batch.candidates, batch.rivals);
            lanes::TriangleHit best_hit;
            intersect_triangles(rays, best, no_end, batch.rivals, best_hit);
            store(best_hit.t, batch.best_t);
            store(best.prim_ids, batch.best_ids);
        }
        const float* const row = packet_.frame.rows_f[2];
        const FloatVec z =
            mul_add(splat(row[2]), dir.z, mul_add(splat(row[1]), dir.y, splat(row[0]) * dir.x));
        store(hit.t, batch.t);
        store(triangles.prim_ids, batch.ids);
        store(splat(1.0f) / (hit.t * z), batch.q);
    }

    /// Makes the hits that are closer than their ray's candidate its candidate. A ray may have
    /// several pairs in the batch.
    void take_closest(Batch& batch, BlockSet& changed) {
        const float q_error = hit_depth_error(packet_.frame);
        for (std::uint32_t hits = batch.hits; hits != 0; hits &= hits - 1) {
            const std::uint32_t l = first_bit(hits);
            if ((batch.rivals >> l & 1) != 0 &&
                !is_closer(batch.t[l], batch.ids[l], batch.best_t[l], batch.best_ids[l]))
                continue;
            const std::uint32_t ray = batch.rays[l];
            packet_.q_lower[ray] = std::max(batch.q[l] * (1 - q_error), 0.0f);
            packet_.q_upper[ray] = std::min(batch.q[l] * (1 + q_error), kAnyDepth);
            packet_.candidate[ray] = batch.triangles[l];
            const std::uint32_t block = ray / kBlockRays;
            changed.words[block / 64] |= std::uint64_t{1} << block % 64;
            for (const std::uint32_t other : BitsOf(hits & (hits - 1))) {
                if (batch.rays[other] != ray) continue;
                batch.rivals |= 1u << other;
                batch.best_t[other] = batch.t[l];
                batch.best_ids[other] = batch.ids[l];
            }
        }
    }

    CameraPacket& packet_;
    std::size_t count_ = 0;
    std::uint32_t rays_[kMany + kLanes], triangles_[kMany + kLanes];
};

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
