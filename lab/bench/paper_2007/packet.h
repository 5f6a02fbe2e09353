// Packets of 16 x 16 rays with a common origin.
#pragma once

#include <array>
#include <vector>

#include "lab/bench/paper_2007/lanes.h"
#include "lab/bench/trace_work.h"

namespace mray::bench::paper_2007 {

inline constexpr int kPacketSide = 16;
inline constexpr int kGroups = kPacketSide * kPacketSide / kLanes;

/// A packet as it is given: groups of 4x4 pixels.
struct PacketRays {
    vec3 org;
    Floats dir[3][kGroups];
    /// Negative where there is no ray.
    Floats tfar[kGroups];
    /// Directions between which all rays are, if there are such.
    std::array<vec3, 4> corners;
    bool has_corners;
    /// Where group i's rays are in the work: rays first_ray[i] to first_ray[i] + 16.
    std::array<std::size_t, kGroups> first_ray;
};

/// A packet's answers: t, u, v and prim_id (-1: none), or for any hit t < 0 where a ray is
/// occluded.
struct PacketAnswers {
    Floats t[kGroups], u[kGroups], v[kGroups];
    Ints prim_id[kGroups];
};

/// The packets of a tile of a work, of primary or shadow rays; those without a ray are left out.
std::vector<PacketRays> make_packets(const TraceWork& work, const TileRays& tile);

}  // namespace mray::bench::paper_2007
