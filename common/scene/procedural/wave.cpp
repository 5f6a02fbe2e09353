#include "common/scene/procedural/parts/colours.h"
#include "common/scene/procedural/parts/surfaces.h"
#include "common/scene/procedural/parts/trig.h"
#include "common/scene/procedural/scenes.h"

namespace mray {
namespace {

constexpr double kHeight = 0.12;
// The faster wave goes round once in 12 frames: 0.12 ((2 pi / 12)^2 + (2 pi / 24)^2) = 0.042.
constexpr double kAcceleration = 0.042;

}  // namespace

DeformingMesh make_wave(std::uint64_t triangles) {
    const Sheet sheet(triangles);
    DeformingMesh mesh;
    sheet.append_to(mesh.topology, [&](std::uint32_t row, std::uint32_t column) {
        return palette(8 * row / sheet.grid().rows + 3 * (8 * column / sheet.grid().columns));
    });
    mesh.acceleration = kAcceleration;
    mesh.move = [sheet](double frame, VertexRange range, std::span<vec3> out) {
        const std::uint32_t stride = sheet.grid().columns + 1;
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            const double x = 2.0 * (i % stride) / sheet.grid().columns - 1;
            const std::uint32_t row = i / stride;
            const double z = 2.0 * row / sheet.grid().rows - 1;
            const double y = kHeight * (sin_turns(1.5 * x + 0.5 * z - frame / 12) +
                                        sin_turns(2.5 * z - x + frame / 24));
            out[i] = round_to_float({x, y, z});
        }
    };
    return mesh;
}

}  // namespace mray
