#include "tests/support/closed_joints.h"

#include <map>
#include <utility>

namespace mray::test {
namespace {

struct OpenMesh {
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
};

/// Splits edge k of triangle i at a random place of it, and fills the crack to the other triangle.
void add_joint(OpenMesh& mesh, std::size_t i, int k, Random& random) {
    const uvec3 old = mesh.triangles[i];
    const std::uint32_t p = old[k];
    const std::uint32_t q = old[(k + 1) % 3];
    const std::uint32_t r = old[(k + 2) % 3];
    const auto m = static_cast<std::uint32_t>(mesh.positions.size());
    const float at = random.below(2) == 0 ? 0.5f : static_cast<float>(random.real(0, 1));
    const vec3 a = mesh.positions[p];
    mesh.positions.push_back(a + (mesh.positions[q] - a) * at);
    mesh.triangles[i] = {p, m, r};
    mesh.triangles.push_back({m, q, r});
    mesh.triangles.push_back({p, q, m});
}

}  // namespace

TestScene sphere_with_joints(int levels, std::uint32_t joints, std::uint32_t collapses,
                             double scale, const vec3& centre, std::uint64_t seed) {
    Random random(seed);
    const TestScene sphere = icosphere(levels);
    OpenMesh mesh{sphere.world_positions(), sphere.topology().triangles};
    for (std::uint32_t n = 0; n < joints; ++n) {
        const std::uint32_t i = random.below(static_cast<std::uint32_t>(mesh.triangles.size()));
        add_joint(mesh, i, static_cast<int>(random.below(3)), random);
    }
    for (vec3& p : mesh.positions) {
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = static_cast<float>((double{p[axis]} + centre[axis]) * scale);
    }
    for (std::uint32_t n = 0; n < collapses; ++n) {
        const uvec3 t =
            mesh.triangles[random.below(static_cast<std::uint32_t>(mesh.triangles.size()))];
        mesh.positions[t.x] = mesh.positions[t.y];
    }
    return {mesh.positions, mesh.triangles};
}

bool is_closed(const std::vector<uvec3>& triangles) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> surplus;
    for (const uvec3& t : triangles) {
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t p = t[k];
            const std::uint32_t q = t[(k + 1) % 3];
            if (p < q) ++surplus[{p, q}];
            if (q < p) --surplus[{q, p}];
        }
    }
    for (const auto& [edge, count] : surplus) {
        if (count != 0) return false;
    }
    return true;
}

std::vector<Ray> rays_at_joints(const TestScene& scene, const vec3& centre, double scale,
                                std::size_t count, Random& random) {
    const std::vector<uvec3>& triangles = scene.topology().triangles;
    const std::vector<vec3>& p = scene.positions();
    const float jitter = 0.01f * static_cast<float>(scene.space().length_to_scene(scale));
    std::vector<Ray> rays;
    while (rays.size() < count) {
        const uvec3 t = triangles[random.below(static_cast<std::uint32_t>(triangles.size()))];
        const auto part = [&] { return static_cast<float>(random.real(0, 1)); };
        const float f = rays.size() % 3 == 0 ? 0.0f : part();
        const float g = rays.size() % 3 != 2 ? 0.0f : (1 - f) * part();
        const vec3 target = p[t.x] + (p[t.y] - p[t.x]) * f + (p[t.z] - p[t.x]) * g;
        const vec3 org = snap_point(centre + random.point(1) * jitter);
        const vec3 dir = target - org;
        if (dir == vec3(0, 0, 0)) continue;
        rays.push_back({org, 0, canonical_direction(dir), kInfiniteT});
    }
    return rays;
}

}  // namespace mray::test
