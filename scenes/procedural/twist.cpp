#include <algorithm>

#include "scenes/procedural/helpers.h"
#include "scenes/procedural/procedural.h"
#include "scenes/trig.h"

namespace mray {
namespace {

constexpr double kLastFrame = 24;
constexpr double kMostTurns = 4;
constexpr double kSide = 1;
constexpr std::uint32_t kLayersPerAcross = 4;
constexpr double kHeight = kLayersPerAcross * kSide;
// The part of its cell that a box fills along each axis.
constexpr double kFilled = 0.85;

// layers layers of across x across boxes.
struct Column {
    std::uint32_t across;
    std::uint32_t layers;
    std::uint32_t box_count() const { return across * across * layers; }
};

Column column_of(std::uint64_t boxes) {
    const std::uint32_t across = std::max(1u, cube_root(boxes / kLayersPerAcross));
    const std::uint64_t area = std::uint64_t{across} * across;
    const auto layers = static_cast<std::uint32_t>((boxes + area / 2) / area);
    return {across, std::max(1u, layers)};
}

// Corner c of a box lies at the upper end of x, y, z where bits 0, 1, 2 of c are set.
constexpr std::uint32_t kBoxTriangles[12][3] = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5},
                                                {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                                {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};

void append_box(Topology& topology, Albedo albedo) {
    for (const auto& corners : kBoxTriangles) {
        topology.triangles.push_back(uvec3(corners[0], corners[1], corners[2]) +
                                     uvec3(topology.vertex_count));
        topology.albedo.push_back(albedo);
    }
    topology.vertex_count += 8;
}

// The middle of cell `index` of `count` cells in [0, extent].
double box_end(std::uint32_t index, std::uint32_t count, bool upper, double extent) {
    return extent * (index + 0.5 + (upper ? 0.5 : -0.5) * kFilled) / count;
}

glm::dvec3 rest_position(const Column& column, std::uint32_t vertex) {
    const std::uint32_t box = vertex / 8;
    const std::uint32_t x = box % column.across;
    const std::uint32_t z = box / column.across % column.across;
    const std::uint32_t y = box / (column.across * column.across);
    return {box_end(x, column.across, vertex & 1, kSide) - kSide / 2,
            box_end(y, column.layers, vertex & 2, kHeight),
            box_end(z, column.across, vertex & 4, kSide) - kSide / 2};
}

}  // namespace

DeformingMesh make_twist(std::uint64_t triangles) {
    const Column column = column_of((triangles + 6) / 12);
    DeformingMesh mesh;
    mesh.topology.triangles.reserve(12 * std::size_t{column.box_count()});
    mesh.topology.albedo.reserve(12 * std::size_t{column.box_count()});
    for (std::uint32_t box = 0; box < column.box_count(); ++box) {
        // A colour a quarter of the cross-section, so that the turns show as stripes.
        const std::uint32_t right = 2 * (box % column.across) >= column.across;
        const std::uint32_t front = 2 * (box / column.across % column.across) >= column.across;
        append_box(mesh.topology, palette(2 * front + right));
    }
    mesh.last_frame = kLastFrame;
    mesh.move = [column](double frame, VertexRange range, std::span<vec3> out) {
        const double turns = kMostTurns * frame / kLastFrame;
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            const glm::dvec3 p = rest_position(column, i);
            const CosSin turn = circle_point(turns * p.y / kHeight);
            out[i] = round_to_float(
                {turn.cos * p.x + turn.sin * p.z, p.y, turn.cos * p.z - turn.sin * p.x});
        }
    };
    return mesh;
}

}  // namespace mray
