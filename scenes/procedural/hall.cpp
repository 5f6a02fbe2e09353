#include <algorithm>
#include <cmath>

#include "scenes/procedural/parts/colours.h"
#include "scenes/procedural/parts/random.h"
#include "scenes/procedural/parts/swaying_mesh.h"
#include "scenes/procedural/scenes.h"
#include "scenes/trig.h"

namespace mray {
namespace {

constexpr std::uint64_t kSeed = 0x4A11;
constexpr double kLength = 20;
constexpr double kWidth = 7;
constexpr double kHeight = 9;
constexpr double kAisle = 4;
// Cables end before the walls, so that no edge of theirs is outside.
constexpr double kCableEnd = 0.02;
constexpr std::uint32_t kBays = 10;
constexpr std::uint32_t kBanners = kBays - 1;
constexpr std::uint32_t kColumnSides = 16;
constexpr double kBannerSway = 0.25;

/// Beams along the hall, cables across all of it: long triangles that no box fits.
void add_beams(SwayingMesh& mesh, std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
        const double across = (2 * uniform(kSeed, i, 1) - 1) * (kWidth - 0.5);
        if (i % 3 == 0) {
            const double y = kHeight - 0.3 - 0.8 * uniform(kSeed, i, 2);
            mesh.add_box({-kLength, y - 0.12, across - 0.1}, {kLength, y + 0.12, across + 0.1},
                         rgb(96, 70, 44));
        } else {
            const double x = (2 * uniform(kSeed, i, 3) - 1) * (kLength - 1);
            const glm::dvec3 from(x, 6.5 + 1.5 * uniform(kSeed, i, 4), kCableEnd - kWidth);
            const glm::dvec3 to(
                std::clamp(x + 24 * uniform(kSeed, i, 5) - 12, 1 - kLength, kLength - 1),
                6.5 + 1.5 * uniform(kSeed, i, 6), kWidth - kCableEnd);
            mesh.add_tube({from, to, 0.012, 0.012, 4, 1}, rgb(30, 30, 34));
        }
    }
}

/// Two rows of columns, a little thicker in the middle, each on a block.
void add_columns(SwayingMesh& mesh, std::uint64_t triangles) {
    const std::uint64_t each = triangles / (2 * kBays);
    const std::uint32_t sides = each < 120 ? 6 : kColumnSides;
    const std::uint32_t segments = TubeShape::segments_for(each < 12 ? 0 : each - 12, sides);
    for (std::uint32_t i = 0; i < 2 * kBays; ++i) {
        if (each < 12 + TubeShape::triangle_count(sides, segments)) return;
        const double x = -kLength + (i / 2 + 0.5) * (2 * kLength / kBays);
        const double z = i % 2 == 0 ? -kAisle : kAisle;
        mesh.add_box({x - 0.6, 0, z - 0.6}, {x + 0.6, 0.35, z + 0.6}, rgb(150, 144, 130));
        mesh.add_tube({{x, 0.35, z}, {x, kHeight, z}, 0.38, 0.46, sides, segments},
                      rgb(186, 176, 156));
    }
}

/// Cloths between the columns of one side and of the other in turn, held at their upper edges.
void add_banners(SwayingMesh& mesh, std::uint64_t triangles) {
    const std::uint64_t each = triangles / kBanners;
    const auto rows = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(each)));
    if (rows < 1) return;
    const auto columns = std::max(1u, static_cast<std::uint32_t>(each / (2 * rows)));
    for (std::uint32_t i = 0; i < kBanners; ++i) {
        const double x = -kLength + (i + 1) * (2 * kLength / kBays);
        const double z = i % 2 == 0 ? -kAisle : kAisle;
        mesh.add_sheet(rows, columns, palette(i), [&](double s, double t) -> SwayingVertex {
            const double fold = 0.15 * t * sin_turns(2.5 * s + 0.3 * i);
            return {{x + 1.6 * s - 0.8, 7.5 - 3.2 * t, z + fold},
                    {0.1 * kBannerSway * t, 0, kBannerSway * t * t},
                    0.37 * i + 0.2 * s};
        });
    }
}

/// Blocks of stone on the floor of the aisles, each turned.
void add_blocks(SwayingMesh& mesh, std::uint64_t triangles) {
    for (std::uint64_t i = 0; mesh.triangle_count() + 6 <= triangles; ++i) {
        const double side = uniform(kSeed, i, 10) < 0.5 ? -1 : 1;
        const double size = 0.04 + 0.2 * uniform(kSeed, i, 11) * uniform(kSeed, i, 12);
        const CosSin turn = circle_point(uniform(kSeed, i, 13));
        const double z = side * (kAisle + 0.9 + (kWidth - kAisle - 1.3) * uniform(kSeed, i, 14));
        const double x = (2 * uniform(kSeed, i, 15) - 1) * (kLength - 0.5);
        mesh.add_box({{x, size, z},
                      {1.5 * size * turn.cos, 0, -1.5 * size * turn.sin},
                      {0, size, 0},
                      {size * turn.sin, 0, size * turn.cos}},
                     palette(hash_bits(kSeed, i) >> 8));
    }
}

}  // namespace

DeformingMesh make_hall(std::uint64_t triangles) {
    SwayingMesh mesh;
    mesh.add_room({-kLength, 0, -kWidth}, {kLength, kHeight, kWidth}, rgb(168, 160, 146));
    add_beams(mesh, std::min<std::uint64_t>(triangles / 400, 400));
    add_columns(mesh, triangles / 2);
    const std::uint64_t banners = triangles / 5;
    if (triangles > banners) add_blocks(mesh, triangles - banners);
    add_banners(mesh, triangles - std::min(triangles, mesh.triangle_count()));
    DeformingMesh finished = std::move(mesh).finish();
    finished.inside_view = InsideView{{-17, 2.2, 0}, {10, 3, 0.5}, {1, 6.2, 0.4}};
    return finished;
}

}  // namespace mray
