#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "scenes/procedural/parts/colours.h"
#include "scenes/procedural/parts/random.h"
#include "scenes/procedural/parts/swaying_mesh.h"
#include "scenes/procedural/scenes.h"

namespace mray {
namespace {

constexpr std::uint64_t kSeed = 0x4A12;
constexpr std::uint32_t kQuads = 8;
constexpr std::uint64_t kStrandTriangles = 2 * kQuads;
constexpr double kLength = 1.1;
constexpr double kFall = 0.55;
constexpr double kSway = 0.12;
constexpr double kRootWidth = 0.008;
constexpr double kTipWidth = 0.0012;

/// A strip that leaves the ball at a right angle, bends, and falls.
void add_strand(SwayingMesh& mesh, std::uint64_t strand) {
    const glm::dvec3 root = uniform_direction(kSeed, strand, 0);
    const glm::dvec3 curl = 0.35 * uniform_direction(kSeed, strand, 2);
    const double length = kLength * (0.6 + 0.4 * uniform(kSeed, strand, 4));
    const double phase = 0.2 * uniform(kSeed, strand, 5);
    glm::dvec3 across = glm::cross(root, uniform_direction(kSeed, strand, 6));
    across /= std::max(1e-6, glm::length(across));
    const glm::dvec3 sway = kSway * (root.x < 0 ? glm::dvec3(1, 0, 0.4) : glm::dvec3(0.8, 0, -0.5));
    mesh.add_sheet(kQuads, 1, rgb(110, 62, 30) + static_cast<Albedo>(strand % 24),
                   [&](double side, double s) -> SwayingVertex {
                       const double out = 1 + length * (s - 0.35 * s * s);
                       const double width = kRootWidth + s * (kTipWidth - kRootWidth);
                       const glm::dvec3 middle =
                           out * root + s * s * curl - glm::dvec3(0, kFall * length * s * s, 0);
                       return {middle + (side - 0.5) * width * across, s * s * sway, phase};
                   });
}

}  // namespace

DeformingMesh make_hair(std::uint64_t triangles) {
    SwayingMesh mesh;
    mesh.add_sphere({0, 0, 0}, 1, std::min<std::uint64_t>(triangles / 20, 20000),
                    rgb(190, 140, 110));
    for (std::uint64_t strand = 0; mesh.triangle_count() + kStrandTriangles / 2 <= triangles;
         ++strand)
        add_strand(mesh, strand);
    return std::move(mesh).finish();
}

}  // namespace mray
