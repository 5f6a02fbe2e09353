#include "scenes/procedural/parts/colours.h"
#include "scenes/procedural/parts/surfaces.h"
#include "scenes/procedural/parts/waves.h"
#include "scenes/procedural/scenes.h"

namespace mray {

DeformingMesh make_wave(std::uint64_t triangles) {
    const Sheet sheet(triangles);
    DeformingMesh mesh;
    sheet.append_to(mesh.topology, [&](std::uint32_t row, std::uint32_t column) {
        return palette(8 * row / sheet.grid().rows + 3 * (8 * column / sheet.grid().columns));
    });
    mesh.move = [sheet](double frame, VertexRange range, std::span<vec3> out) {
        const std::uint32_t stride = sheet.grid().columns + 1;
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            const double x = 2.0 * (i % stride) / sheet.grid().columns - 1;
            const std::uint32_t row = i / stride;
            const double z = 2.0 * row / sheet.grid().rows - 1;
            out[i] = round_to_float({x, wave_height(x, z, frame), z});
        }
    };
    return mesh;
}

}  // namespace mray
