#include <cmath>

#include "scenes/procedural/parts/colours.h"
#include "scenes/procedural/parts/surfaces.h"
#include "scenes/procedural/scenes.h"
#include "scenes/trig.h"

namespace mray {
namespace {

// Not the origin, so that the point and the plane that it collapses to lie nowhere special.
const glm::dvec3 kCentre(0.3, 0.2, -0.1);

// Frames 0, 4, 8, ...: whole. 2, 10, 18: the plane y = kCentre.y. 6, 14, 22: the point kCentre.
constexpr double kPeriod = 8;

glm::dvec3 scale_at(double frame) {
    const double phase = frame / kPeriod - std::floor(frame / kPeriod);
    const double cosine = cos_turns(phase);
    const double shrunk = cosine * cosine;  // exactly 0 a quarter and three quarters through
    return phase < 0.5 ? glm::dvec3(1, shrunk, 1) : glm::dvec3(shrunk);
}

}  // namespace

DeformingMesh make_collapse(std::uint64_t triangles) {
    const Sphere sphere(triangles);
    DeformingMesh mesh;
    sphere.append_to(mesh.topology, [&](std::uint32_t row, std::uint32_t column) {
        return palette(8 * column / sphere.grid().columns + 3 * (4 * row / sphere.grid().rows));
    });
    mesh.move = [sphere](double frame, VertexRange range, std::span<vec3> out) {
        const glm::dvec3 scale = scale_at(frame);
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            const glm::dvec3 d = sphere.direction(i);
            const double bumps = cos_turns(1.2 * d.x) * cos_turns(1.2 * d.y) * cos_turns(1.2 * d.z);
            out[i] = round_to_float(kCentre + (1 + 0.15 * bumps) * scale * d);
        }
    };
    return mesh;
}

}  // namespace mray
