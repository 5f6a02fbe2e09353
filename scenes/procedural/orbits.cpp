#include <algorithm>
#include <cmath>
#include <vector>

#include "scenes/procedural/helpers.h"
#include "scenes/procedural/procedural.h"

namespace mray {
namespace {

constexpr std::uint64_t kSeed = 0x0B17;
constexpr std::uint32_t kMostBalls = 120;
constexpr double kNearest = 0.25;
constexpr double kFarthest = 1.0;
constexpr double kSlowest = 1.0 / 30;
constexpr double kFastest = 1.0 / 12;

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
        // Keeps the total near the request.
        const std::uint64_t due = triangles * (i + 1) / count;
        if (due < made + 6 && i + 1 < count) continue;
        const Ball& ball = balls.emplace_back(Ball{Sphere(std::max(due, made) - made), vertices});
        made += ball.sphere.triangle_count();
        vertices += ball.sphere.vertex_count();
    }
    return balls;
}

glm::dvec3 on_orbit(std::uint32_t ball, double frame) {
    const glm::dvec3 axis = uniform_direction(kSeed, ball, 0);
    const glm::dvec3 any = uniform_direction(kSeed, ball, 2);
    const glm::dvec3 across = glm::cross(axis, any);
    const double radius = kNearest + (kFarthest - kNearest) * uniform(kSeed, ball, 4);
    const double speed = kSlowest + (kFastest - kSlowest) * uniform(kSeed, ball, 5);
    const CosSin turn = circle_point(uniform(kSeed, ball, 6) + speed * frame);
    return rotate(radius / glm::length(across) * across, axis, turn);
}

/// Where a ball stands until the next time that all jump at once: uniform in the unit ball.
glm::dvec3 after_jumps(std::uint32_t ball, double frame) {
    constexpr double kFramesAtRest = 3;
    const auto draw = 8 + 5 * static_cast<std::uint64_t>(std::floor(frame / kFramesAtRest));
    // The largest of three is spread like a cube root.
    const double radius = std::max({uniform(kSeed, ball, draw), uniform(kSeed, ball, draw + 1),
                                    uniform(kSeed, ball, draw + 2)});
    return radius * uniform_direction(kSeed, ball, draw + 3);
}

using Centre = glm::dvec3 (*)(std::uint32_t ball, double frame);

DeformingMesh make_moving_balls(std::uint64_t triangles, Centre centre_of) {
    const std::vector<Ball> balls = make_balls(triangles);
    DeformingMesh mesh;
    for (std::size_t i = 0; i < balls.size(); ++i) {
        balls[i].sphere.append_to(mesh.topology,
                                  [i](std::uint32_t, std::uint32_t) { return palette(i); });
    }
    const double size = 0.5 / (1 + cube_root(balls.size()));
    mesh.move = [balls, size, centre_of](double frame, VertexRange range, std::span<vec3> out) {
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

}  // namespace

DeformingMesh make_orbits(std::uint64_t triangles) {
    return make_moving_balls(triangles, on_orbit);
}

DeformingMesh make_teleport(std::uint64_t triangles) {
    return make_moving_balls(triangles, after_jumps);
}

}  // namespace mray
