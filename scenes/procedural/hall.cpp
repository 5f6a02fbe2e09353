#include "scenes/procedural/hall.h"

#include <algorithm>

namespace mray {
namespace {

/// Swings through `rest` by `sway` to both sides, once in 12 frames, from a phase in turns.
struct SwayingVertex {
    glm::dvec3 rest;
    glm::dvec3 sway{0};
    double phase = 0;
};

constexpr double kFramesOfSwing = 12;

glm::dvec3 any_perpendicular(const glm::dvec3& axis) {
    const glm::dvec3 other = std::abs(axis.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
    const glm::dvec3 across = glm::cross(axis, other);
    return across / glm::length(across);
}

class SwayingMesh {
public:
    std::uint64_t triangle_count() const { return mesh_.topology.triangles.size(); }

    /// Twelve triangles, counter-clockwise from outside if the half axes are right-handed.
    void add_box(const glm::dvec3& middle, const glm::dvec3& x, const glm::dvec3& y,
                 const glm::dvec3& z, Albedo albedo) {
        const std::uint32_t first = mesh_.topology.vertex_count;
        for (std::uint32_t i = 0; i < 8; ++i) {
            const glm::dvec3 corner = middle + ((i & 1) != 0 ? x : -x) + ((i & 2) != 0 ? y : -y) +
                                      ((i & 4) != 0 ? z : -z);
            add_vertex({.rest = corner});
        }
        constexpr std::uint32_t kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
        for (const auto& f : kFaces)
            add_quad(first + f[0], first + f[1], first + f[2], first + f[3], albedo);
    }
    /// The box [lower, upper], or a room of this size, which is seen from inside.
    void add_box(const glm::dvec3& lower, const glm::dvec3& upper, Albedo albedo,
                 bool is_room = false) {
        const glm::dvec3 half = 0.5 * (upper - lower);
        // Left-handed axes turn every face around.
        add_box(0.5 * (lower + upper), {is_room ? -half.x : half.x, 0, 0}, {0, half.y, 0},
                {0, 0, half.z}, albedo);
    }

    /// A round bar between two points, which differ, with closed ends; `radius` at both ends and
    /// `middle_radius` between them. It has at least 3 sides and 1 segment.
    void add_tube(const glm::dvec3& from, const glm::dvec3& to, double radius, double middle_radius,
                  std::uint32_t sides, std::uint32_t segments, Albedo albedo) {
        const glm::dvec3 along = to - from;
        const glm::dvec3 axis = along / glm::length(along);
        const glm::dvec3 u = any_perpendicular(axis);
        const glm::dvec3 v = glm::cross(axis, u);
        const std::uint32_t first = mesh_.topology.vertex_count;
        for (std::uint32_t ring = 0; ring <= segments; ++ring) {
            const double s = static_cast<double>(ring) / segments;
            const double wide = radius + 4 * s * (1 - s) * (middle_radius - radius);
            for (std::uint32_t side = 0; side < sides; ++side) {
                const CosSin around = circle_point(static_cast<double>(side) / sides);
                add_vertex({.rest = from + s * along + wide * (around.cos * u + around.sin * v)});
            }
        }
        const auto at = [&](std::uint32_t ring, std::uint32_t side) {
            return first + ring * sides + side % sides;
        };
        for (std::uint32_t ring = 0; ring < segments; ++ring) {
            for (std::uint32_t side = 0; side < sides; ++side)
                add_quad(at(ring, side), at(ring, side + 1), at(ring + 1, side + 1),
                         at(ring + 1, side), albedo);
        }
        for (std::uint32_t side = 1; side + 1 < sides; ++side) {
            append_triangle(mesh_.topology, at(0, 0), at(0, side + 1), at(0, side), albedo);
            append_triangle(mesh_.topology, at(segments, 0), at(segments, side),
                            at(segments, side + 1), albedo);
        }
    }

    /// at(s, t) gives the vertices for s (along a row) and t (down the rows) from 0 to 1.
    void add_sheet(std::uint32_t rows, std::uint32_t columns, Albedo albedo,
                   const std::function<SwayingVertex(double s, double t)>& at) {
        const std::uint32_t first = mesh_.topology.vertex_count;
        for (std::uint32_t row = 0; row <= rows; ++row) {
            for (std::uint32_t column = 0; column <= columns; ++column)
                add_vertex(
                    at(static_cast<double>(column) / columns, static_cast<double>(row) / rows));
        }
        for (std::uint32_t row = 0; row < rows; ++row) {
            for (std::uint32_t column = 0; column < columns; ++column) {
                const std::uint32_t a = first + row * (columns + 1) + column;
                const std::uint32_t d = a + columns + 1;
                add_quad(a, d, d + 1, a + 1, albedo);
            }
        }
    }

    DeformingMesh finish() && {
        mesh_.move = [vertices = std::move(vertices_)](double frame, IndexRange range,
                                                       std::span<vec3> out) {
            for (std::uint32_t i = range.begin; i < range.end; ++i) {
                const SwayingVertex& v = vertices[i];
                out[i] = round_to_float(v.sway == glm::dvec3(0)
                                            ? v.rest
                                            : v.rest + sin_turns(frame / kFramesOfSwing + v.phase) *
                                                           v.sway);
            }
        };
        return std::move(mesh_);
    }

private:
    void add_vertex(const SwayingVertex& vertex) {
        vertices_.push_back(vertex);
        ++mesh_.topology.vertex_count;
    }

    void add_quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d,
                  Albedo albedo) {
        append_triangle(mesh_.topology, a, b, c, albedo);
        append_triangle(mesh_.topology, a, c, d, albedo);
    }

    DeformingMesh mesh_;
    std::vector<SwayingVertex> vertices_;
};

constexpr std::uint64_t kSeed = 0x4A11;
constexpr double kLength = 20;
constexpr double kWidth = 7;
constexpr double kHeight = 9;
constexpr double kAisle = 4;
// Cables end before the walls, so that no edge of theirs is outside.
constexpr double kCableEnd = 0.02;
constexpr std::uint32_t kBays = 10;
constexpr std::uint32_t kBanners = kBays - 1;
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
            mesh.add_tube(from, to, 0.012, 0.012, 4, 1, rgb(30, 30, 34));
        }
    }
}

/// Two rows of columns, a little thicker in the middle, each on a block.
void add_columns(SwayingMesh& mesh, std::uint64_t triangles) {
    const std::uint64_t each = triangles / (2 * kBays);
    const std::uint32_t sides = each < 120 ? 6 : 16;
    // All but the block and the ends.
    const std::uint64_t walls = each - std::min<std::uint64_t>(each, 12 + 2 * (sides - 2));
    const auto segments =
        static_cast<std::uint32_t>(std::max<std::uint64_t>(1, walls / (2 * sides)));
    if (each < 12 + 2 * (std::uint64_t{sides} * segments + sides - 2)) return;
    for (std::uint32_t i = 0; i < 2 * kBays; ++i) {
        const double x = -kLength + (i / 2 + 0.5) * (2 * kLength / kBays);
        const double z = i % 2 == 0 ? -kAisle : kAisle;
        mesh.add_box({x - 0.6, 0, z - 0.6}, {x + 0.6, 0.35, z + 0.6}, rgb(150, 144, 130));
        mesh.add_tube({x, 0.35, z}, {x, kHeight, z}, 0.38, 0.46, sides, segments,
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
        mesh.add_box({x, size, z}, {1.5 * size * turn.cos, 0, -1.5 * size * turn.sin}, {0, size, 0},
                     {size * turn.sin, 0, size * turn.cos}, palette(hash_bits(kSeed, i) >> 8));
    }
}

}  // namespace

DeformingMesh make_hall(std::uint64_t triangles) {
    SwayingMesh mesh;
    mesh.add_box({-kLength, 0, -kWidth}, {kLength, kHeight, kWidth}, rgb(168, 160, 146), true);
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
