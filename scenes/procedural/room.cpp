#include <algorithm>
#include <cmath>

#include "scenes/procedural/parts/colours.h"
#include "scenes/procedural/parts/random.h"
#include "scenes/procedural/parts/swaying_mesh.h"
#include "scenes/procedural/scenes.h"
#include "scenes/trig.h"

namespace mray {
namespace {

constexpr std::uint64_t kSeed = 0x3004;
constexpr double kLength = 5;
constexpr double kWidth = 3.5;
constexpr double kHeight = 3;
constexpr double kSeat = 0.45;
constexpr double kLeg = 0.014;
constexpr double kCurtainSway = 0.1;
constexpr std::uint32_t kMostChairs = 40;
// Four legs, four bars between them, and seven in the back.
constexpr std::uint32_t kBars = 15;
constexpr std::uint64_t kLeastChair = kBars * 20 + 12;

/// A place on the floor, and the direction that a chair there faces.
struct Place {
    double x, z;
    CosSin turn;

    glm::dvec3 operator()(double right, double up, double ahead) const {
        return {x + right * turn.cos + ahead * turn.sin, up,
                z - right * turn.sin + ahead * turn.cos};
    }
};

/// Adds a chair of thin bars, each of about bar_triangles triangles.
void add_chair(SwayingMesh& mesh, const Place& at, std::uint64_t bar_triangles) {
    const std::uint32_t sides = bar_triangles < 60 ? 3 : 6;
    const std::uint32_t segments = TubeShape::segments_for(bar_triangles, sides);
    const Albedo wood = rgb(120, 76, 40);
    const auto bar = [&](const glm::dvec3& from, const glm::dvec3& to, double radius) {
        mesh.add_tube({from, to, radius, 1.3 * radius, sides, segments}, wood);
    };
    const double w = 0.2;
    for (const double x : {-w, w}) {
        for (const double z : {-w, w}) bar(at(1.15 * x, 0.003, 1.15 * z), at(x, kSeat, z), kLeg);
        bar(at(x, 0.2, -w), at(x, 0.2, w), 0.6 * kLeg);
        bar(at(x, 0.3, -w), at(x, 0.3, w), 0.6 * kLeg);
    }
    for (int i = 0; i < 6; ++i) {
        const double x = w * (0.4 * i - 1);
        bar(at(x, kSeat, -w), at(1.1 * x, 0.9, -w - 0.1), 0.5 * kLeg);
    }
    bar(at(-1.2 * w, 0.9, -w - 0.1), at(1.2 * w, 0.9, -w - 0.1), kLeg);
    const glm::dvec3 middle = at(0, kSeat, 0);
    mesh.add_box(
        {middle, at(1.1 * w, kSeat, 0) - middle, {0, 0.015, 0}, at(0, kSeat, 1.1 * w) - middle},
        palette(hash_bits(kSeed, static_cast<std::uint64_t>(64 * (at.x + at.z + 20)))));
}

void add_table(SwayingMesh& mesh) {
    const Albedo wood = rgb(150, 104, 60);
    mesh.add_box({-2.6, 0.72, -0.55}, {2.6, 0.76, 0.55}, wood);
    for (const double x : {-2.5, 2.5}) {
        for (const double z : {-0.45, 0.45})
            mesh.add_box({x - 0.03, 0, z - 0.03}, {x + 0.03, 0.72, z + 0.03}, wood);
    }
}

/// Adds chairs along both sides of the table, then by the walls, with about `triangles` triangles
/// in all, or none.
void add_chairs(SwayingMesh& mesh, std::uint64_t triangles) {
    const auto count =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(kMostChairs, triangles / kLeastChair));
    for (std::uint32_t i = 0; i < count; ++i) {
        const bool by_table = i < 16;
        const std::uint32_t n = by_table ? i : i - 16;
        const double side = n % 2 == 0 ? -1 : 1;
        const double row = n / 2;
        const double x = by_table ? -2.3 + 0.65 * row : -4.4 + 0.78 * row;
        const double z = side * (by_table ? 0.85 : 2.9);
        const double facing = (side < 0 ? 0 : 0.5) + 0.06 * (uniform(kSeed, i, 1) - 0.5);
        add_chair(mesh, {x + 0.05 * uniform(kSeed, i, 2), z, circle_point(facing)},
                  (triangles / count - 12) / kBars);
    }
}

/// Lamps above the table, on wires.
void add_lamps(SwayingMesh& mesh, std::uint64_t triangles) {
    constexpr std::uint32_t kLamps = 4;
    constexpr std::uint64_t kWire = 20;
    if (triangles < kLamps * (kWire + 24)) return;
    for (std::uint32_t i = 0; i < kLamps; ++i) {
        const double x = -2.1 + 1.4 * i;
        mesh.add_tube({{x, 2.1, 0}, {x, kHeight, 0}, 0.004, 0.004, 4, 2}, rgb(20, 20, 20));
        mesh.add_sphere({x, 2.0, 0}, 0.14, triangles / kLamps - kWire, rgb(230, 220, 190));
    }
}

/// Shelves at one end, with books; more things lie on the table and on the floor.
void add_clutter(SwayingMesh& mesh, std::uint64_t triangles) {
    for (int shelf = 0; shelf < 6 && mesh.triangle_count() + 24 < triangles; ++shelf) {
        const double y = 0.3 + 0.4 * shelf;
        mesh.add_box({kLength - 0.35, y - 0.02, -3.2}, {kLength - 0.02, y, 3.2}, rgb(140, 110, 80));
    }
    const std::uint64_t left = triangles - std::min(triangles, mesh.triangle_count());
    const double size = std::min(1.0, 12 / std::sqrt(1.0 + static_cast<double>(left) / 12));
    for (std::uint64_t i = 0; mesh.triangle_count() + 6 <= triangles; ++i) {
        const CosSin turn = circle_point(uniform(kSeed, i, 10));
        const double w = size * (0.02 + 0.08 * uniform(kSeed, i, 11));
        const double h = size * (0.01 + 0.05 * uniform(kSeed, i, 12));
        const double d = size * (0.05 + 0.1 * uniform(kSeed, i, 13));
        const double a = 2 * uniform(kSeed, i, 14) - 1;
        const double b = 2 * uniform(kSeed, i, 15) - 1;
        const auto place = hash_bits(kSeed, i) % 8;
        const Albedo albedo = palette(hash_bits(kSeed, i) >> 8);
        if (place < 4) {
            // A book that stands on a shelf.
            const double y = 0.3 + 0.4 * static_cast<double>(hash_bits(kSeed + 1, i) % 6);
            mesh.add_box({kLength - 0.3, y, 3.1 * a - h},
                         {kLength - 0.08, y + 0.12 + d, 3.1 * a + h}, albedo);
            continue;
        }
        const bool on_table = place < 6;
        const glm::dvec3 middle(a * (on_table ? 2.4 : 4.5), (on_table ? 0.76 : 0.0) + h,
                                b * (on_table ? 0.45 : 3.2));
        mesh.add_box(
            {middle, {w * turn.cos, 0, -w * turn.sin}, {0, h, 0}, {d * turn.sin, 0, d * turn.cos}},
            albedo);
    }
}

/// A curtain in folds, held at its upper edge, by the wall without shelves.
void add_curtain(SwayingMesh& mesh, std::uint64_t triangles) {
    const auto rows = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(triangles) / 4));
    if (rows < 1) return;
    const auto columns = static_cast<std::uint32_t>(triangles / (2 * rows));
    mesh.add_sheet(rows, columns, rgb(150, 40, 44), [](double s, double t) -> SwayingVertex {
        const double fold = 0.06 * sin_turns(12 * s);
        return {{-kLength + 0.3 + fold, kHeight - 0.15 - 2.7 * t, 5 * s - 2.5},
                {kCurtainSway * t * t, 0, 0.2 * kCurtainSway * t},
                1.5 * s};
    });
}

}  // namespace

DeformingMesh make_room(std::uint64_t triangles) {
    SwayingMesh mesh;
    mesh.add_room({-kLength, 0, -kWidth}, {kLength, kHeight, kWidth}, rgb(196, 188, 172));
    if (triangles >= 100) add_table(mesh);
    add_chairs(mesh, triangles * 11 / 20);
    add_lamps(mesh, triangles / 10);
    const std::uint64_t curtain = triangles / 10;
    add_clutter(mesh, triangles - curtain);
    add_curtain(mesh, triangles - std::min(triangles, mesh.triangle_count()));
    DeformingMesh finished = std::move(mesh).finish();
    finished.inside_view = InsideView{{-4.3, 1.7, -2.9}, {1.2, 0.7, 0.6}, {0.7, 2.6, 0.5}};
    return finished;
}

}  // namespace mray
