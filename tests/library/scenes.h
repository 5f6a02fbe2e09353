// Meshes and rays for tests of the library, as its users have them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "morphray/morphray.hpp"
#include "tests/support/test_scene.h"

namespace mray::test {

/// A mesh in arrays of its own.
struct UserMesh {
    std::vector<morphray::Vec3> points;
    std::vector<std::uint32_t> triangles;

    UserMesh() = default;
    explicit UserMesh(const TestScene& scene) {
        for (const vec3& p : scene.world_positions()) points.push_back({p.x, p.y, p.z});
        for (const uvec3& t : scene.topology().triangles)
            triangles.insert(triangles.end(), {t.x, t.y, t.z});
    }

    morphray::MeshView view(bool deforms = true) const {
        return {morphray::packed(points), triangles, deforms};
    }
};

/// The meshes must outlive their views.
inline std::vector<morphray::MeshView> views_of(const std::vector<UserMesh>& meshes,
                                                bool deform = true) {
    std::vector<morphray::MeshView> views;
    for (const UserMesh& mesh : meshes) views.push_back(mesh.view(deform));
    return views;
}

/// Every instruction set of this machine, and none.
inline std::vector<std::string> all_simd() {
    std::vector<std::string> names = morphray::simd_targets();
    names.emplace_back("off");
    return names;
}

/// A turn about (0, 1, 1), scaled, with the last axis multiplied by `last`, and a shift along x.
inline morphray::Transform turned(double angle, double last, double shift) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    return {{{{c, -s, 0, shift}, {0.8 * s, 0.8 * c, -0.6 * last, 0.1}, {0.6, 0.1, last, -0.2}}}};
}

/// Moves points as the guide says: the bits of Scene::update(geom_id, transform).
inline void move(const morphray::Transform& pose, const UserMesh& rest, UserMesh& moved,
                 const morphray::Point& origin = {}) {
    for (std::size_t i = 0; i < rest.points.size(); ++i) {
        const auto [x, y, z] = rest.points[i];
        float p[3];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::array<double, 4>& row = pose.rows[axis];
            const auto m0 = static_cast<float>(row[0]);
            const auto m1 = static_cast<float>(row[1]);
            const auto m2 = static_cast<float>(row[2]);
            p[axis] = ((m0 * x + m1 * y) + m2 * z) + static_cast<float>(row[3] - origin[axis]);
        }
        moved.points[i] = {p[0], p[1], p[2]};
    }
}

/// Rays of floats in world space: from around and inside a mesh, at its vertices and along axes.
inline std::vector<morphray::Ray> world_rays(const UserMesh& mesh, std::size_t count,
                                             std::uint64_t seed) {
    Random random(seed);
    const auto vertex = [&] {
        return mesh.points.empty() ? morphray::Vec3{} : random.pick(mesh.points);
    };
    std::vector<morphray::Ray> rays(count);
    for (morphray::Ray& ray : rays) {
        const morphray::Vec3 at = vertex();
        const morphray::Vec3 from = vertex();
        const vec3 jitter = random.point(0.5);
        ray.org = {3 * from.x + jitter.x, 3 * from.y + jitter.y, 3 * from.z + jitter.z};
        ray.dir = {at.x - ray.org.x, at.y - ray.org.y, at.z - ray.org.z};
        if (random.below(8) == 0) ray.dir = {0, 0, random.below(2) == 0 ? 1.0f : -2.5f};
        if (random.below(8) == 0) ray.tnear = static_cast<float>(random.real(-1, 1));
        if (random.below(8) == 0) ray.tfar = static_cast<float>(random.real(0, 2));
    }
    return rays;
}

inline std::vector<morphray::Hit> hits_of(const morphray::Scene& scene,
                                          const std::vector<morphray::Ray>& rays,
                                          morphray::Coherence coherence = {}) {
    std::vector<morphray::Hit> hits(rays.size());
    scene.intersect(rays, hits, {coherence});
    return hits;
}

inline std::size_t count_hits(const std::vector<morphray::Hit>& hits) {
    return hits.size() - static_cast<std::size_t>(std::ranges::count(hits, morphray::Hit{}));
}

/// Equal bit by bit.
inline void expect_same_hits(const std::vector<morphray::Hit>& a,
                             const std::vector<morphray::Hit>& b, const std::string& what = {}) {
    ASSERT_EQ(a.size(), b.size());
    std::size_t different = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        different += std::memcmp(&a[i], &b[i], sizeof(a[i])) != 0;
    EXPECT_EQ(different, 0u) << what;
}

/// The code of the error that `work` throws, or "none".
template <class Work>
std::string error_of(Work work) {
    try {
        work();
    } catch (const morphray::Error& error) {
        EXPECT_STRNE(error.what(), "");
        return morphray::to_string(error.code());
    }
    return "none";
}

/// A scene that has come here through updates answers as one that is built at its positions.
inline void expect_as_new(const morphray::Scene& scene,
                          const std::vector<morphray::MeshView>& meshes,
                          const morphray::SceneOptions& options,
                          const std::vector<morphray::Ray>& rays, const std::string& what) {
    const morphray::Scene fresh =
        morphray::Scene::build(meshes, morphray::Device::brute_force(), options);
    const std::vector<morphray::Hit> expected = hits_of(fresh, rays);
    expect_same_hits(hits_of(scene, rays), expected, what);
}

}  // namespace mray::test
