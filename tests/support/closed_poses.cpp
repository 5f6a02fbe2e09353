#include "tests/support/closed_poses.h"

namespace mray::test {

std::vector<vec3> breathing(const std::vector<vec3>& positions, Random& random) {
    std::vector<vec3> moved;
    for (const vec3& p : positions)
        moved.push_back(snap_point(p * static_cast<float>(random.real(2.0 / 3, 1))));
    return moved;
}

std::vector<Ray> rays_from_inside(const TestScene& scene, const std::vector<vec3>& positions,
                                  std::size_t count, Random& random) {
    const std::vector<uvec3>& triangles = scene.topology().triangles;
    std::vector<Ray> rays;
    while (rays.size() < count) {
        const uvec3 t = triangles[random.below(static_cast<std::uint32_t>(triangles.size()))];
        const vec3 a = positions[t.x];
        const vec3 b = positions[t.y];
        const float f = rays.size() % 2 == 0 ? 0.0f : static_cast<float>(random.real(0, 1));
        const vec3 org = snap_point(random.point(0.01 * kSceneExtent));
        rays.push_back({org, 0, canonical_direction(a + (b - a) * f - org), kInfiniteT});
    }
    return rays;
}

}  // namespace mray::test
