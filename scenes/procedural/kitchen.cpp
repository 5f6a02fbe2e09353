#include <algorithm>
#include <array>
#include <cmath>

#include <glm/vec2.hpp>

#include "scenes/procedural/parts/colours.h"
#include "scenes/procedural/parts/random.h"
#include "scenes/procedural/parts/swaying_mesh.h"
#include "scenes/procedural/scenes.h"
#include "scenes/trig.h"

namespace mray {
namespace {

constexpr std::uint64_t kSeed = 0x317C;
constexpr double kLength = 2.6;
constexpr double kWidth = 2.0;
constexpr double kHeight = 2.7;
constexpr double kWorktop = 0.9;
constexpr double kDepth = 0.6;
// Cupboards are this wide, along the wall at -kWidth.
constexpr double kCupboard = 0.52;
constexpr int kCupboards = 10;
constexpr double kShelfHeights[] = {1.45, 1.8, 2.15};
constexpr double kTableHeight = 0.74;
constexpr double kTowelSway = 0.03;

double random_at(std::uint64_t i, std::uint64_t k) { return uniform(kSeed, i, k); }

/// The outline of a vessel: radius and height for t from 0, the foot, over the rim back to the
/// middle of the inside, for a height and a radius of 1.
struct Outline {
    std::array<glm::dvec2, 8> points;

    glm::dvec2 at(double t) const {
        const double place = t * static_cast<double>(points.size() - 1);
        const auto i = std::min(static_cast<std::size_t>(place), points.size() - 2);
        const double rest = place - static_cast<double>(i);
        return points[i] * (1 - rest) + points[i + 1] * rest;
    }
};

constexpr double kSkin = 0.96;
const Outline kOutlines[] = {
    // A bottle, a cup, a bowl, a plate, a jar and a pan.
    {{{{0, 0}, {1, 0.02}, {1, 0.55}, {0.35, 0.72}, {0.32, 1}, {0.28, 1}, {0.28, 0.7}, {0, 0.6}}}},
    {{{{0, 0}, {0.7, 0.02}, {0.95, 0.5}, {1, 1}, {kSkin, 1}, {0.9, 0.5}, {0.65, 0.08}, {0, 0.06}}}},
    {{{{0, 0}, {0.4, 0}, {0.85, 0.4}, {1, 1}, {kSkin, 1}, {0.8, 0.45}, {0.4, 0.1}, {0, 0.08}}}},
    {{{{0, 0}, {0.6, 0}, {0.7, 0.4}, {1, 1}, {0.99, 1.1}, {0.7, 0.6}, {0.6, 0.3}, {0, 0.3}}}},
    {{{{0, 0}, {1, 0}, {1, 0.85}, {0.8, 0.92}, {0.85, 1}, {0.7, 1.04}, {0.3, 1.06}, {0, 1.06}}}},
    {{{{0, 0}, {0.9, 0}, {1, 0.3}, {1, 1}, {kSkin, 1}, {kSkin, 0.3}, {0.85, 0.1}, {0, 0.08}}}},
};
// Radius and height of each.
constexpr glm::dvec2 kSizes[] = {{0.036, 0.27}, {0.04, 0.09}, {0.085, 0.07},
                                 {0.11, 0.02},  {0.05, 0.13}, {0.11, 0.12}};

/// A vessel of about that many triangles that stands on `foot`.
void add_vessel(SwayingMesh& mesh, std::size_t kind, const glm::dvec3& foot, double scale,
                std::uint64_t triangles, Albedo albedo) {
    // Three times as many around as along half of the outline.
    const auto rows =
        static_cast<std::uint32_t>(std::max(7.0, std::sqrt(static_cast<double>(triangles) / 3)));
    const auto columns =
        static_cast<std::uint32_t>(std::max<std::uint64_t>(3, triangles / (2 * rows)));
    const glm::dvec2 size = scale * kSizes[kind];
    mesh.add_sheet(rows, columns, albedo, [&](double s, double t) -> SwayingVertex {
        const CosSin around = circle_point(s);
        const glm::dvec2 p = kOutlines[kind].at(t) * size;
        return {foot + glm::dvec3(p.x * around.cos, p.y, p.x * around.sin)};
    });
}

/// A door with a frame and a handle, whose lower left corner is (x, y) and whose face is at z.
void add_door(SwayingMesh& mesh, const glm::dvec3& corner, double height,
              std::uint64_t handle_triangles) {
    const Albedo paint = rgb(206, 210, 198);
    const double w = kCupboard - 0.01;
    const double edge = 0.06;
    const auto slab = [&](double x0, double y0, double x1, double y1, double thick) {
        mesh.add_box(corner + glm::dvec3(x0, y0, 0), corner + glm::dvec3(x1, y1, thick), paint);
    };
    slab(edge, edge, w - edge, height - edge, 0.01);
    slab(0, 0, w, edge, 0.02);
    slab(0, height - edge, w, height, 0.02);
    slab(0, edge, edge, height - edge, 0.02);
    slab(w - edge, edge, w, height - edge, 0.02);
    constexpr std::uint32_t kSides = 8;
    const glm::dvec3 middle = corner + glm::dvec3(w / 2, height - 0.1, 0.045);
    const std::uint32_t segments = TubeShape::segments_for(handle_triangles / 3, kSides);
    const Albedo steel = rgb(150, 152, 156);
    mesh.add_tube({middle - glm::dvec3(0.07, 0, 0), middle + glm::dvec3(0.07, 0, 0), 0.005, 0.008,
                   kSides, segments},
                  steel);
    for (const double x : {-0.06, 0.06}) {
        const glm::dvec3 foot = middle + glm::dvec3(x, 0, -0.025);
        mesh.add_tube({foot, foot + glm::dvec3(0, 0, 0.025), 0.004, 0.004, kSides, segments},
                      steel);
    }
}

/// Cupboards below the worktop, and boards above it.
void add_cupboards(SwayingMesh& mesh, std::uint64_t triangles) {
    const Albedo wood = rgb(140, 100, 62);
    mesh.add_box({-kLength, 0, -kWidth}, {kLength, kWorktop - 0.04, -kWidth + kDepth - 0.05},
                 rgb(190, 194, 184));
    mesh.add_box({-kLength, kWorktop - 0.04, -kWidth}, {kLength, kWorktop, -kWidth + kDepth}, wood);
    for (int i = 0; i < kCupboards; ++i) {
        add_door(mesh, {-kLength + kCupboard * i, 0.1, -kWidth + kDepth - 0.05}, 0.74,
                 triangles / kCupboards);
    }
    for (const double y : kShelfHeights) {
        mesh.add_box({-kLength, y - 0.025, -kWidth}, {kLength - 0.9, y, -kWidth + 0.32}, wood);
        for (int i = 0; i <= 5; ++i) {
            const double x = -kLength + 0.05 + 0.8 * i;
            mesh.add_box({x - 0.01, y - 0.2, -kWidth}, {x + 0.01, y - 0.025, -kWidth + 0.02}, wood);
        }
    }
}

/// Tiles with joints between them, on the wall above the worktop.
void add_tiles(SwayingMesh& mesh, std::uint64_t triangles) {
    constexpr double kJoint = 0.003;
    const double high = kShelfHeights[0] - 0.025 - kWorktop;
    const double side =
        std::max(0.05, std::sqrt(2 * kLength * high * 12 / (1.0 + static_cast<double>(triangles))));
    for (double y = kWorktop; y + side <= kWorktop + high; y += side) {
        for (double x = -kLength; x + side <= kLength; x += side) {
            const auto at = static_cast<std::uint64_t>(mesh.triangle_count());
            mesh.add_box({x + kJoint, y + kJoint, -kWidth},
                         {x + side - kJoint, y + side - kJoint, -kWidth + 0.006},
                         hash_bits(kSeed, at) % 7 == 0 ? rgb(96, 132, 150) : rgb(222, 220, 210));
        }
    }
}

void add_table(SwayingMesh& mesh) {
    const Albedo wood = rgb(168, 122, 74);
    mesh.add_box({-0.9, kTableHeight - 0.03, 0.3}, {0.9, kTableHeight, 1.1}, wood);
    for (const double x : {-0.84, 0.84}) {
        for (const double z : {0.36, 1.04})
            mesh.add_box({x - 0.03, 0, z - 0.03}, {x + 0.03, kTableHeight - 0.03, z + 0.03}, wood);
    }
}

/// Stools of bent bars around the table.
void add_stools(SwayingMesh& mesh, std::uint64_t triangles) {
    constexpr std::uint32_t kStools = 6;
    constexpr std::uint32_t kSides = 6;
    constexpr std::uint32_t kBars = 8;
    const std::uint32_t segments =
        TubeShape::segments_for(triangles / kStools * 2 / 3 / kBars, kSides);
    for (std::uint32_t i = 0; i < kStools; ++i) {
        const double x = -0.65 + 0.65 * (i % 3) + 0.1 * random_at(i, 1);
        const double z = i < 3 ? 0.05 : 1.4;
        for (int leg = 0; leg < 4; ++leg) {
            const CosSin out = circle_point(leg / 4.0 + 0.1 * random_at(i, 2));
            const CosSin next = circle_point((leg + 1) / 4.0 + 0.1 * random_at(i, 2));
            const auto place = [&](const CosSin& c, double r, double y) {
                return glm::dvec3(x + r * c.cos, y, z + r * c.sin);
            };
            mesh.add_tube(
                {place(out, 0.2, 0.002), place(out, 0.13, 0.44), 0.011, 0.013, kSides, segments},
                rgb(60, 62, 66));
            mesh.add_tube(
                {place(out, 0.175, 0.16), place(next, 0.175, 0.16), 0.006, 0.006, kSides, segments},
                rgb(60, 62, 66));
        }
        constexpr std::size_t kPlate = 3;
        add_vessel(mesh, kPlate, {x, 0.44, z}, 1.5, triangles / kStools / 3,
                   palette(hash_bits(kSeed, i)));
    }
}

/// A window's blind, of thin slats.
void add_blind(SwayingMesh& mesh) {
    for (int i = 0; i < 40; ++i) {
        const glm::dvec3 middle(kLength - 0.05, 1.1 + 0.03 * i, 0.4);
        mesh.add_box({middle, {0.012, 0.006, 0}, {-0.0004, 0.0008, 0}, {0, 0, 0.7}},
                     rgb(232, 228, 216));
    }
}

/// Vessels of several sizes on worktop, shelves, table and floor; the fewer, the less detail they
/// have.
void add_vessels(SwayingMesh& mesh, std::uint64_t triangles) {
    const auto each = std::clamp<std::uint64_t>(triangles / 300, 60, 6000);
    for (std::uint64_t i = 0; mesh.triangle_count() + 42 < triangles; ++i) {
        const std::uint64_t bits = hash_bits(kSeed + 1, i);
        const double detail = 0.3 + 1.4 * random_at(i, 20);
        const auto own = std::min(static_cast<std::uint64_t>(detail * static_cast<double>(each)),
                                  triangles - mesh.triangle_count());
        const double scale = 0.75 + 0.5 * random_at(i, 21);
        const double a = 2 * random_at(i, 22) - 1;
        const double b = random_at(i, 23);
        const std::uint64_t place = bits % 16;
        glm::dvec3 foot;
        if (place < 6) {
            foot = {a * (kLength - 0.2), kWorktop, -kWidth + 0.12 + b * (kDepth - 0.24)};
        } else if (place < 12) {
            foot = {-0.45 + a * (kLength - 0.6), kShelfHeights[bits / 16 % 3],
                    -kWidth + 0.1 + 0.12 * b};
        } else if (place < 15) {
            foot = {0.8 * a, kTableHeight, 0.4 + 0.6 * b};
        } else {
            foot = {a * (kLength - 0.3), 0.001, -kWidth + kDepth + 0.2 + b * 2.4};
        }
        add_vessel(mesh, bits / 64 % std::size(kOutlines), foot, scale, own, palette(bits >> 20));
    }
}

/// A rack of wires on the worktop, with plates that stand in it.
void add_rack(SwayingMesh& mesh, std::uint64_t triangles) {
    constexpr std::uint32_t kWires = 24;
    constexpr std::uint32_t kSides = 6;
    const std::uint32_t segments = TubeShape::segments_for(triangles / 2 / kWires, kSides);
    for (std::uint32_t i = 0; i < kWires; ++i) {
        const double x = 1.2 + 0.02 * (i / 2);
        const double z = -kWidth + (i % 2 == 0 ? 0.2 : 0.42);
        mesh.add_tube({{x, kWorktop + 0.01, z},
                       {x + 0.03, kWorktop + 0.17, z},
                       0.0018,
                       0.0018,
                       kSides,
                       segments},
                      rgb(160, 162, 166));
    }
    for (std::uint32_t i = 0; i < 8; ++i) {
        const glm::dvec3 middle(1.22 + 0.03 * i, kWorktop + 0.11, -kWidth + 0.31);
        const auto rows = static_cast<std::uint32_t>(
            std::max(7.0, std::sqrt(static_cast<double>(triangles) / 16 / 3)));
        mesh.add_sheet(rows, 3 * rows, rgb(226, 224, 220),
                       [&](double s, double t) -> SwayingVertex {
                           const CosSin around = circle_point(s);
                           const glm::dvec2 p = kOutlines[3].at(t) * kSizes[3];
                           return {middle + glm::dvec3(p.y + 0.2 * p.x * around.cos,
                                                       p.x * around.cos, p.x * around.sin)};
                       });
    }
}

/// A towel on a rail, held at its upper edge.
void add_towel(SwayingMesh& mesh, std::uint64_t triangles) {
    const auto rows = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(triangles) / 4));
    if (rows < 1) return;
    const auto columns = static_cast<std::uint32_t>(triangles / (2 * rows));
    mesh.add_sheet(rows, columns, rgb(60, 108, 160), [](double s, double t) -> SwayingVertex {
        const double fold = 0.015 * sin_turns(5 * s);
        return {{-1.5 + 0.45 * s, 0.82 - 0.5 * t, -kWidth + kDepth + 0.05 + fold},
                {0.2 * kTowelSway * t, 0, kTowelSway * t * t},
                1.5 * s};
    });
}

}  // namespace

DeformingMesh make_kitchen(std::uint64_t triangles) {
    SwayingMesh mesh;
    mesh.add_room({-kLength, 0, -kWidth}, {kLength, kHeight, kWidth}, rgb(214, 206, 190));
    const std::uint64_t towel = triangles / 20;
    if (triangles >= 12000) {
        add_cupboards(mesh, triangles / 20);
        add_table(mesh);
        add_stools(mesh, triangles / 12);
        add_blind(mesh);
        add_tiles(mesh, triangles / 16);
        add_rack(mesh, triangles / 20);
    }
    add_vessels(mesh, triangles - towel);
    add_towel(mesh, triangles - std::min(triangles, mesh.triangle_count()));
    DeformingMesh finished = std::move(mesh).finish();
    finished.inside_view = InsideView{{-1.9, 1.6, 0.9}, {0.5, 0.95, -1.5}, {0.4, 2.4, 0.3}};
    return finished;
}

}  // namespace mray
