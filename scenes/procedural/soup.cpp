#include <algorithm>

#include "scenes/procedural/helpers.h"
#include "scenes/procedural/procedural.h"

namespace mray {
namespace {

constexpr double kLastFrame = 24;
constexpr std::uint64_t kSeed = 0x50B;
constexpr double kSwing = 0.25;
constexpr double kLargest = 0.2;

// Uniform in the cube [-1, 1]^3, from draws k to k + 2.
glm::dvec3 in_cube(std::uint32_t index, std::uint64_t k) {
    return 2.0 * glm::dvec3(uniform(kSeed, index, k), uniform(kSeed, index, k + 1),
                            uniform(kSeed, index, k + 2)) -
           1.0;
}

struct Flight {
    glm::dvec3 centre;
    glm::dvec3 axis;
    CosSin turn;
};

Flight flight_of(std::uint32_t triangle, double frame) {
    const double time = frame / kLastFrame;
    const double swing =
        sin_turns((1 + uniform(kSeed, triangle, 6)) * time + uniform(kSeed, triangle, 7));
    const glm::dvec3 axis = in_cube(triangle, 9);
    return {in_cube(triangle, 0) + kSwing * swing * in_cube(triangle, 3), axis / glm::length(axis),
            circle_point(2 * uniform(kSeed, triangle, 8) * time)};
}

}  // namespace

DeformingMesh make_soup(std::uint64_t triangles) {
    const auto count = static_cast<std::uint32_t>(std::max<std::uint64_t>(1, triangles));
    // Corners in a cube as wide as the space that each triangle has for itself.
    const double size = std::min(kLargest, 1.0 / cube_root(count));
    DeformingMesh mesh;
    mesh.topology.vertex_count = 3 * count;
    mesh.topology.triangles.reserve(count);
    mesh.topology.albedo.reserve(count);
    for (std::uint32_t i = 0; i < count; ++i) {
        mesh.topology.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
        mesh.topology.albedo.push_back(palette(hash_bits(kSeed, i) >> 8));
    }
    mesh.last_frame = kLastFrame;
    mesh.move = [size](double frame, VertexRange range, std::span<vec3> out) {
        Flight flight{};
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            if (i == range.begin || i % 3 == 0) flight = flight_of(i / 3, frame);
            const glm::dvec3 corner = size * in_cube(i, 13);
            out[i] = round_to_float(flight.centre + rotate(corner, flight.axis, flight.turn));
        }
    };
    return mesh;
}

}  // namespace mray
