#include <algorithm>
#include <cmath>

#include "scenes/procedural/parts/colours.h"
#include "scenes/procedural/parts/waves.h"
#include "scenes/procedural/scenes.h"

namespace mray {

DeformingMesh make_degenerate(std::uint64_t triangles) {
    // A quad has two triangles with an area and a needle without, each grid vertex a point:
    // 3 rows columns + (rows + 1) (columns + 1) in all.
    const auto wanted = static_cast<double>(triangles);
    const auto rows = static_cast<std::uint32_t>(std::max(1.0, std::round(std::sqrt(wanted / 4))));
    const auto columns = static_cast<std::uint32_t>(
        std::max(1.0, std::round((wanted - rows - 1) / (4.0 * rows + 1))));
    const std::uint32_t grid = (rows + 1) * (columns + 1);
    DeformingMesh mesh;
    // Vertices i, i + grid and i + 2 grid are at one place.
    mesh.topology.vertex_count = 3 * grid;
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, Albedo albedo) {
        mesh.topology.triangles.push_back({a, b, c});
        mesh.topology.albedo.push_back(albedo);
    };
    for (std::uint32_t row = 0; row < rows; ++row) {
        for (std::uint32_t column = 0; column < columns; ++column) {
            const std::uint32_t a = row * (columns + 1) + column;
            const std::uint32_t d = a + columns + 1;
            const Albedo albedo = palette(8 * row / rows + 3 * (8 * column / columns));
            add(a, d, d + 1, albedo);
            add(a, d + 1, a + 1, albedo);
            // Along the quad's diagonal, where rays that aim at the edge meet it.
            add(a, d + 1, d + 1 + grid, rgb(255, 0, 0));
        }
    }
    for (std::uint32_t i = 0; i < grid; ++i) add(i, i + grid, i + 2 * grid, rgb(255, 0, 0));
    mesh.move = [rows, columns, grid](double frame, VertexRange range, std::span<vec3> out) {
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            const std::uint32_t place = i % grid;
            const double x = 2.0 * (place % (columns + 1)) / columns - 1;
            const double z = 2.0 * (place / (columns + 1)) / rows - 1;
            out[i] = round_to_float({x, wave_height(x, z, frame), z});
        }
    };
    return mesh;
}

}  // namespace mray
