// Rays of a light, and triangles that reach past a light or an eye, for tests of packets.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/arithmetic.h"
#include "common/interop/ray.h"
#include "cpu/packet/light_packet.h"
#include "tests/support/test_scene.h"

namespace mray::test {

/// Blocks of the active rays; the others are absent.
inline std::vector<cpu::SharedOriginRays> blocks_of(std::span<const Ray> rays,
                                                    std::span<const std::uint8_t> active) {
    std::vector<cpu::SharedOriginRays> blocks(rays.size() / cpu::kBlockRays,
                                              cpu::SharedOriginRays::none());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (active[i] != 0) blocks[i / cpu::kBlockRays].set(i % cpu::kBlockRays, rays[i]);
    }
    return blocks;
}

/// The ray from org to somewhere between target / 2 and target, times `reach`.
inline Ray ray_towards(vec3 org, vec3 target, float reach) {
    const vec3 way = snap_point(target) - org;
    Ray ray;
    ray.org = org;
    ray.tnear = 0;
    ray.dir = canonical_direction(way);
    ray.tfar = power_of_two_below(largest_component(way)) * reach;
    return ray;
}

/// Long triangles that reach past `place`: in turn thin ones near it, and wide ones whose planes
/// nearly hold it.
inline TestScene triangles_past(const vec3& place, std::uint64_t seed) {
    Random random(seed);
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
    const auto power = [&](int most, std::uint32_t count) {
        return std::ldexp(1.0, most - static_cast<int>(random.below(count)));
    };
    for (std::uint32_t i = 0; i < 6; ++i) {
        const bool is_thin = i % 2 == 0;
        const vec3 a = random.point();
        const vec3 beyond = (place - a) * static_cast<float>(random.real(0.2, 1));
        const double distance = is_thin ? power(-1, 6) : power(-16, 10);
        const double width = is_thin ? distance * power(-3, 10) : power(-1, 6);
        const vec3 c = place + beyond + random.point(distance);
        positions.insert(positions.end(), {a, a + random.point(width), c});
        triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    return TestScene(positions, triangles);
}

}  // namespace mray::test
