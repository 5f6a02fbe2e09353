#include "tests/support/motions.h"

#include <cmath>
#include <functional>
#include <limits>
#include <memory>

#include "common/scene/scene_space.h"
#include "scenes/procedural/procedural.h"

namespace mray::test {
namespace {

constexpr std::uint64_t kTriangles = 900;

std::vector<std::vector<vec3>> to_scene(const SceneSpace& space,
                                        const std::vector<std::vector<vec3>>& world) {
    std::vector<std::vector<vec3>> poses;
    for (const std::vector<vec3>& pose : world) {
        poses.emplace_back(pose.size());
        space.to_scene(pose, poses.back());
    }
    return poses;
}

Motion of_builtin(const std::string& name, const std::vector<double>& frames) {
    const std::unique_ptr<Animation> animation = make_procedural(name, kTriangles);
    std::vector<std::vector<vec3>> world;
    WorldBounds bounds;
    for (const double frame : frames) {
        world.emplace_back(animation->topology().vertex_count);
        animation->positions(frame, world.back());
        bounds.extend(bounds_of(world.back()));
    }
    return {name, animation->topology(), to_scene(SceneSpace(bounds), world)};
}

using Move = std::function<vec3(std::size_t pose, std::size_t vertex, vec3 at)>;

/// Poses of a test scene's world positions, each moved within twice the scene's extent.
Motion of_scene(const std::string& name, const TestScene& scene, std::size_t count,
                const Move& move) {
    std::vector<std::vector<vec3>> world;
    for (std::size_t pose = 0; pose < count; ++pose) {
        std::vector<vec3>& positions = world.emplace_back(scene.world_positions());
        for (std::size_t i = 0; i < positions.size(); ++i)
            positions[i] = move(pose, i, positions[i]);
    }
    WorldBounds bounds;
    for (int axis = 0; axis < 3; ++axis) {
        bounds.lower[axis] = -8;
        bounds.upper[axis] = 8;
    }
    return {name, scene.topology(), to_scene(SceneSpace(bounds), world)};
}

vec3 turned_about_y(vec3 p, double angle) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    return {static_cast<float>(c * p.x + s * p.z), p.y, static_cast<float>(c * p.z - s * p.x)};
}

}  // namespace

std::vector<Motion> hard_motions() {
    const std::vector<double> some = {0, 1, 2, 3, 5, 8, 12, 12, 18, 24};
    std::vector<Motion> motions;
    for (const char* name : {"cloth", "twist", "herd", "orbits", "shuffle", "soup"}) {
        motions.push_back(of_builtin(name, some));
    }
    // Whole, plane, whole, point, whole.
    const auto fold = [](std::size_t pose, auto, vec3 p) {
        const std::size_t phase = pose % 8;
        return phase == 2 ? vec3(p.x, 0, p.z) : phase == 6 ? vec3(0.25f, 0, 0) : p;
    };
    const auto folding = [&](const char* name, std::size_t build_at) {
        motions.push_back(of_scene(name, icosphere(3), 9, fold));
        motions.back().build_at = build_at;
    };
    folding("collapse", 0);
    folding("collapse, built in the point", 6);
    folding("collapse, built in the plane", 2);

    const double pi = std::acos(-1.0);
    motions.push_back(of_scene("8 turns", torus(24, 16), 9, [&](std::size_t pose, auto, vec3 p) {
        return turned_about_y(p, 2 * pi * static_cast<double>(pose) * p.y);
    }));
    motions.push_back(of_scene("teleport", grid_box(8), 8, [](std::size_t pose, auto i, vec3 p) {
        const bool away = pose >= 3 && pose < 6 && i % 5 < 2;
        return away ? p + vec3(5, 4, -3) : p;
    }));
    motions.push_back(
        of_scene("swing", random_soup(400, 0.1, 4), 12, [](std::size_t pose, auto i, vec3 p) {
            return pose % 2 == 0 ? p : p * (1.0f + 0.4f * static_cast<float>(i / 3 % 3));
        }));
    motions.push_back(of_scene("many meshes at once", random_soup(400, 0.1, 5), 8,
                               [](std::size_t pose, auto i, vec3 p) {
                                   Random random(i / 3);
                                   return pose < 4 ? p : p + random.point(3);
                               }));
    motions.push_back(
        of_scene("NaN in the middle", icosphere(3), 8, [](std::size_t pose, std::size_t i, vec3 p) {
            const float nan = std::numeric_limits<float>::quiet_NaN();
            return pose >= 3 && pose < 5 && i % 7 == 0 ? vec3(nan, p.y, p.z) : p;
        }));
    return motions;
}

}  // namespace mray::test
