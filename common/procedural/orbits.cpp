#include <algorithm>
#include <vector>

#include "common/procedural/colours.h"
#include "common/procedural/integer_root.h"
#include "common/procedural/random.h"
#include "common/procedural/rotation.h"
#include "common/procedural/scenes.h"
#include "common/procedural/surfaces.h"

namespace morphray {
namespace {

constexpr std::uint64_t kSeed = 0x0B17;
constexpr std::uint32_t kMostBalls = 120;
constexpr double kNearest = 0.25;
constexpr double kFarthest = 1.0;
// Once in 12 frames at the fastest: (2 pi / 12)^2.
constexpr double kSlowest = 1.0 / 30;
constexpr double kFastest = 1.0 / 12;
constexpr double kAcceleration = 0.275;

struct Ball {
    Sphere sphere;
    std::uint32_t first_vertex;
};

std::vector<Ball> make_balls(std::uint64_t triangles) {
    const std::uint32_t count = std::clamp(cube_root(triangles) * 4, 1u, kMostBalls);
    std::vector<Ball> balls;
    std::uint64_t made = 0;
    std::uint32_t vertices = 0;
    for (std::uint32_t i = 0; i < count && (i == 0 || made < triangles); ++i) {
        // What keeps the total on its way.
        const std::uint64_t due = triangles * (i + 1) / count;
        if (due < made + 6 && i + 1 < count) continue;
        const Ball& ball = balls.emplace_back(Ball{Sphere(std::max(due, made) - made), vertices});
        made += ball.sphere.triangle_count();
        vertices += ball.sphere.vertex_count();
    }
    return balls;
}

glm::dvec3 centre_of(std::uint32_t ball, double frame) {
    const glm::dvec3 axis = uniform_direction(kSeed, ball, 0);
    const glm::dvec3 any = uniform_direction(kSeed, ball, 2);
    const glm::dvec3 across = glm::cross(axis, any);
    const double radius = kNearest + (kFarthest - kNearest) * uniform(kSeed, ball, 4);
    const double speed = kSlowest + (kFastest - kSlowest) * uniform(kSeed, ball, 5);
    const CosSin turn = circle_point(uniform(kSeed, ball, 6) + speed * frame);
    return rotate(radius / glm::length(across) * across, axis, turn);
}

}  // namespace

DeformingMesh make_orbits(std::uint64_t triangles) {
    const std::vector<Ball> balls = make_balls(triangles);
    DeformingMesh mesh;
    for (std::size_t i = 0; i < balls.size(); ++i) {
        balls[i].sphere.append_to(mesh.topology,
                                  [i](std::uint32_t, std::uint32_t) { return palette(i); });
    }
    mesh.acceleration = kAcceleration;
    const double size = 0.5 / (1 + cube_root(balls.size()));
    mesh.move = [balls, size](double frame, VertexRange range, std::span<vec3> out) {
        const auto after = std::upper_bound(
            balls.begin(), balls.end(), range.begin,
            [](std::uint32_t vertex, const Ball& ball) { return vertex < ball.first_vertex; });
        auto index = static_cast<std::uint32_t>(after - balls.begin() - 1);
        for (std::uint32_t begin = range.begin; begin < range.end; ++index) {
            const Ball& ball = balls[index];
            const std::uint32_t end =
                std::min(range.end, ball.first_vertex + ball.sphere.vertex_count());
            const glm::dvec3 centre = centre_of(index, frame);
            for (; begin < end; ++begin) {
                out[begin] = round_to_float(
                    centre + size * ball.sphere.direction(begin - ball.first_vertex));
            }
        }
    };
    return mesh;
}

}  // namespace morphray
