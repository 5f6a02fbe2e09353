// Packets of 16 x 16 rays with a common origin, in GNU vector types of sixteen floats.
#pragma once

#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include <array>
#include <cstdint>
#include <vector>

#include "lab/bench/trace_work.h"

namespace mray::bench::paper_2007 {

inline constexpr int kLanes = 16;
using Floats __attribute__((vector_size(64))) = float;
/// Also masks: all bits of a lane are set, or none.
using Ints __attribute__((vector_size(64))) = std::int32_t;

// Both take b where a is NaN.
#ifdef __AVX512F__
inline Floats min(const Floats& a, const Floats& b) { return _mm512_min_ps(a, b); }
inline Floats max(const Floats& a, const Floats& b) { return _mm512_max_ps(a, b); }
inline bool any(const Ints& mask) {
    const __m512i bits = reinterpret_cast<__m512i>(mask);
    return _mm512_test_epi32_mask(bits, bits) != 0;
}
#else
inline Floats min(const Floats& a, const Floats& b) { return a < b ? a : b; }
inline Floats max(const Floats& a, const Floats& b) { return a > b ? a : b; }
inline bool any(const Ints& mask) {
    std::int32_t bits = 0;
    for (int i = 0; i < kLanes; ++i) bits |= mask[i];
    return bits != 0;
}
#endif

/// Rays that follow each other in a work: 16 x 16 pixels, in groups of 4 x 4.
inline constexpr int kGroups = 16;
inline constexpr std::size_t kPacketRays = std::size_t{kGroups} * kLanes;
inline constexpr std::size_t kTilePackets = std::size_t{kTileSize} * kTileSize / kPacketRays;

struct PacketRays {
    bool any = false;
    vec3 org;
    Floats dir[3][kGroups];
    /// Negative where there is no ray.
    Floats tfar[kGroups];
    /// Directions between which all rays are, if there are such.
    std::array<vec3, 4> corners;
    bool has_corners = false;
};

/// t, u, v and prim_id (-1: none), or for any hit t < 0 where a ray is occluded.
struct PacketAnswers {
    Floats t[kGroups], u[kGroups], v[kGroups];
    Ints prim_id[kGroups];
};

/// The packets of a work of primary or shadow rays, kTilePackets for each of its tiles.
std::vector<PacketRays> make_packets(const TraceWork& work);

}  // namespace mray::bench::paper_2007
