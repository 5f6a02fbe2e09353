// The triangles of a mesh that pixels show, each loaded once for pixels that are neighbours.
#include <span>

#include "common/scene/mesh.h"
#include "cpu/image/pixel_shader.h"
#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

#if HWY_TARGET != HWY_SCALAR
/// load_threes() by 16 bytes for each: one word after the last is read, too. A call, so that
/// compilers read the indices from memory, and do not take a vector apart.
template <class D>
HWY_NOINLINE void load_threes_at_once(D d, const hn::TFromD<D>* from, const std::uint32_t* at,
                                      hn::Vec<D> out[3]) {
    const hn::CappedTag<hn::TFromD<D>, 4> four;
    const auto load = [&](std::size_t lane)
                          HWY_ATTR { return hn::LoadU(four, from + 3 * std::size_t{at[lane]}); };
    hn::Vec<D> in[4];
    for (std::size_t j = 0; j < 4; ++j) {
        // Lanes j, 4 + j and so on.
        if constexpr (kLanes == 16) {
            const hn::Half<D> half;
            in[j] = hn::Combine(d, hn::Combine(half, load(12 + j), load(8 + j)),
                                hn::Combine(half, load(4 + j), load(j)));
        } else if constexpr (kLanes == 8) {
            in[j] = hn::Combine(d, load(4 + j), load(j));
        } else {
            in[j] = load(j);
        }
    }
    hn::Vec<D> words[4];
    transpose_fours(d, in, words);
    for (int k = 0; k < 3; ++k) out[k] = words[k];
}
#endif

/// Loads the threes of words with these indices from `count` threes, one after the other.
template <class D>
HWY_INLINE void load_threes(D d, const hn::TFromD<D>* from, UintVec index, std::size_t count,
                            hn::Vec<D> out[3]) {
    alignas(64) std::uint32_t at[kLanes];
    store(index, at);
#if HWY_TARGET != HWY_SCALAR
    const UintVec last = splat(static_cast<std::uint32_t>(count - 1));
    if (HWY_LIKELY(none(index == last))) return load_threes_at_once(d, from, at, out);
#else
    (void)count;
#endif
    for (std::size_t k = 0; k < 3; ++k) {
        alignas(64) hn::TFromD<D> words[kLanes];
        for (std::size_t l = 0; l < kLanes; ++l) words[l] = from[3 * std::size_t{at[l]} + k];
        out[k] = hn::Load(d, words);
    }
}

/// Loads the vertices of triangles with these prim_ids, which exist.
HWY_INLINE void load_corners(const Topology& topology, std::span<const vec3> positions,
                             UintVec prim, lanes::Float3 corners[3]) {
    // Neighbours often show the same triangle.
    const std::uint32_t first = hn::GetLane(prim);
    if (all(float_mask(prim == splat(first)))) {
        const uvec3 vertices = topology.triangles[first];
        for (int k = 0; k < 3; ++k) corners[k] = lanes::Float3(positions[vertices[k]]);
        return;
    }
    UintVec vertices[3];
    load_threes(kUints, &topology.triangles.front().x, prim, topology.triangles.size(), vertices);
    for (int k = 0; k < 3; ++k) {
        FloatVec at[3];
        load_threes(kFloats, &positions.front().x, vertices[k], positions.size(), at);
        corners[k] = lanes::Float3(at);
    }
}

/// The normals of what kMostPixels pixels show. Columns of four follow each other.
class ShownTriangles {
public:
    static constexpr std::uint32_t kMostPixels = 256;

    void clear() { vectors_ = count_ = 0; }

    /// Adds pixels that show these triangles, which exist. Neighbours share the same one.
    HWY_INLINE void add(UintVec prim) {
        const UintVec lane = hn::Iota(kUints, 0);
        // The neighbour that a pixel shares its triangle with, or the pixel itself.
        UintVec parent = lane;
        if constexpr (kLanes > 1) {
            const UintVec above = lane - splat(1u);
            parent = select((prim == at(prim, above)) & ((lane & splat(3u)) > 0u), above, parent);
            if constexpr (kLanes > 4) {
                const UintVec left = lane - splat(4u);
                parent = select((prim == at(prim, left)) & (lane > 3u), left, parent);
            }
            // A path has up to 3 steps upwards, and one to the left for each further column.
            for (std::uint32_t steps = 1; steps < 2 + kLanes / 4; steps *= 2)
                parent = at(parent, parent);
        }
        const Mask is_first = float_mask(parent == lane);
        // The number of first lanes below each lane.
        const UintVec below = hn::Shl(splat(1u), lane) - splat(1u);
        const UintVec place = hn::PopulationCount(splat(bits_of(is_first)) & below);
        store(at(place, parent), places_[vectors_]);
        begin_[vectors_++] = count_;
        store_unaligned(hn::Compress(prim, uint_mask(is_first)), prims_ + count_);
        count_ += static_cast<std::uint32_t>(count(is_first));
    }

    void load(const ShadedMesh& mesh) {
        has_degenerate_ = false;
        if (count_ == 0) return;
        store_unaligned(splat(prims_[count_ - 1]), prims_ + count_);
        for (std::uint32_t i = 0; i < count_; i += kLanes) {
            lanes::Float3 v[3];
            load_corners(*mesh.topology, mesh.positions, load_unaligned(prims_ + i), v);
            const lanes::Float3 across = cross3(v[1] - v[0], v[2] - v[0]);
            has_degenerate_ = has_degenerate_ || !all(largest_component(across) > zero());
            const lanes::Float3 n = unit(across);
            store(n.x, normals_[0] + i);
            store(n.y, normals_[1] + i);
            store(n.z, normals_[2] + i);
        }
        for (std::uint32_t i = 0; i < count_; ++i) albedos_[i] = mesh.topology->albedo[prims_[i]];
    }

    /// True if a triangle has two parallel edges, so that its normal is undefined.
    bool has_degenerate() const { return has_degenerate_; }

    /// The unit normals, on the triangles' own side, of vector i of the pixels.
    HWY_INLINE lanes::Float3 normals(std::uint32_t i) const {
        const auto place = hn::IndicesFromVec(kFloats, hn::Load(kUints, places_[i]));
        const auto look_up = [&](const float* from) HWY_ATTR {
            return hn::TableLookupLanes(load_unaligned(from + begin_[i]), place);
        };
        return {look_up(normals_[0]), look_up(normals_[1]), look_up(normals_[2])};
    }

    HWY_INLINE UintVec albedos(std::uint32_t i) const {
        const auto place = hn::IndicesFromVec(kUints, hn::Load(kUints, places_[i]));
        return hn::TableLookupLanes(load_unaligned(albedos_ + begin_[i]), place);
    }

private:
    static HWY_INLINE UintVec at(UintVec values, UintVec lane) {
        return hn::TableLookupLanes(values, hn::IndicesFromVec(kUints, lane & splat(kLanes - 1)));
    }

    static constexpr std::uint32_t kRoom = kMostPixels + kMaxLanes;
    std::uint32_t vectors_ = 0;
    std::uint32_t count_ = 0;
    bool has_degenerate_ = false;
    /// The triangles of vector i begin at begin_[i]; places_[i] are the places of its lanes from
    /// there on.
    std::uint32_t begin_[kMostPixels / kLanes];
    alignas(kCacheLine) std::uint32_t places_[kMostPixels / kLanes][kLanes], prims_[kRoom];
    alignas(kCacheLine) float normals_[3][kRoom];
    alignas(kCacheLine) std::uint32_t albedos_[kRoom];
};

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
