// The triangles of a mesh, one a lane.
#include <span>

#include "common/scene/mesh.h"
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

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
