// Meshes on each device that answers, for the reports of users of other tools.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {

/// The devices' names: brute force, the best and no instruction set, Vulkan.
inline auto report_devices() { return ::testing::Values("brute", "cpu", "off", "vulkan"); }

/// Reports are named by their project and number there.
class Reports : public ::testing::TestWithParam<const char*> {
protected:
    void SetUp() override {
        if (GetParam() == std::string("vulkan") && !has_vulkan()) GTEST_SKIP() << "no device";
    }

    morphray::Scene build(const UserMesh& mesh) const { return build(std::vector{mesh}); }
    /// The meshes must outlive the scene.
    morphray::Scene build(const std::vector<UserMesh>& meshes) const {
        std::vector<morphray::MeshView> views;
        for (const UserMesh& mesh : meshes) views.push_back(mesh.view(false));
        return morphray::Scene::build(views, device());
    }

private:
    static bool has_vulkan() {
        try {
            morphray::Device::vulkan();
            return true;
        } catch (const morphray::Error&) {
            return false;
        }
    }
    morphray::Device device() const {
        const std::string name = GetParam();
        if (name == "brute") return morphray::Device::brute_force();
        if (name == "vulkan") return morphray::Device::vulkan();
        return morphray::Device::cpu({.simd = name == "off" ? "off" : ""});
    }
};

/// A ray from `org` along `dir`.
inline morphray::Ray ray(morphray::Vec3 org, morphray::Vec3 dir) {
    return {.org = org, .dir = dir};
}

inline ::testing::AssertionResult is_within_an_ulp(float value, double exact) {
    const auto nearest = static_cast<float>(exact);
    if (value >= std::nextafter(nearest, -INFINITY) && value <= std::nextafter(nearest, INFINITY))
        return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << value << " instead of " << exact;
}

/// All hits of a ray, nearest first.
inline std::vector<morphray::Hit> all_hits(const morphray::Scene& scene, const morphray::Ray& ray,
                                           morphray::Crossing crossing) {
    return scene.intersect_all(std::span(&ray, 1), {.crossing = crossing}).hits;
}

/// A box, counter-clockwise as seen from outside; corner i has the upper x, y, z of its bits.
inline UserMesh box(morphray::Vec3 lower, morphray::Vec3 upper) {
    UserMesh mesh;
    for (int i = 0; i < 8; ++i) {
        mesh.points.push_back({(i & 1) != 0 ? upper.x : lower.x, (i & 2) != 0 ? upper.y : lower.y,
                               (i & 4) != 0 ? upper.z : lower.z});
    }
    mesh.triangles = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                      2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    return mesh;
}

inline UserMesh tetrahedron() { return UserMesh(TestScene(shapes::tetrahedron())); }

/// A square [lower, upper] x [lower, upper] of two triangles at z = 0.
inline UserMesh square(float lower, float upper) {
    UserMesh mesh;
    mesh.points = {{lower, lower, 0}, {upper, lower, 0}, {upper, upper, 0}, {lower, upper, 0}};
    mesh.triangles = {0, 1, 2, 0, 2, 3};
    return mesh;
}

/// (0, 0, 0), (side, 0, 0), (0, side, 0).
inline UserMesh triangle(float side) {
    UserMesh mesh;
    mesh.points = {{0, 0, 0}, {side, 0, 0}, {0, side, 0}};
    mesh.triangles = {0, 1, 2};
    return mesh;
}

}  // namespace mray::test
