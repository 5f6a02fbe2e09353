#include "clips/procedural/parts/colours.h"
#include "clips/procedural/parts/surfaces.h"
#include "clips/procedural/parts/trig.h"
#include "clips/procedural/scenes.h"

namespace mray {
namespace {

constexpr double kLastFrame = 24;
// The second derivative of the scale, cos(pi frame / 24), times the largest radius:
// (pi / 24)^2 * 1.3.
constexpr double kAcceleration = 0.023;

glm::dvec3 shape(const glm::dvec3& d) {
    const double bumps =
        sin_turns(0.4 * d.x + 0.7 * d.y) + sin_turns(0.9 * d.z - 0.3 * d.x) * cos_turns(0.5 * d.y);
    return (1 + 0.15 * bumps) * d;
}

}  // namespace

DeformingMesh make_mirror(std::uint64_t triangles) {
    const Sphere sphere(triangles);
    DeformingMesh mesh;
    sphere.append_to(mesh.topology, [&](std::uint32_t row, std::uint32_t column) {
        return palette(6 * column / sphere.grid().columns + 5 * (6 * row / sphere.grid().rows));
    });
    mesh.last_frame = kLastFrame;
    mesh.acceleration = kAcceleration;
    mesh.move = [sphere](double frame, VertexRange range, std::span<vec3> out) {
        const double scale = cos_turns(frame / (2 * kLastFrame));
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            const glm::dvec3 p = shape(sphere.direction(i));
            out[i] = round_to_float({scale * p.x, p.y, p.z});
        }
    };
    return mesh;
}

}  // namespace mray
