#include "scenes/procedural/body_scenes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

namespace mray {
namespace {
namespace twist {

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

}  // namespace twist
}  // namespace

DeformingMesh make_twist(std::uint64_t triangles) {
    using namespace twist;
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

namespace {
namespace shuffle {

constexpr std::uint64_t kSeed = 0x5F1;

// A permutation of [0, count) that needs no table. Based on: John Black, Phillip Rogaway. Ciphers
// with arbitrary finite domains. CT-RSA 2002: a Feistel network over the next even power of two,
// repeated until the value is in range (fewer than 4 times on average).
class Permutation {
public:
    /// Key 0 is the identity.
    Permutation(std::uint32_t count, std::uint64_t key)
        : count_(count),
          key_(key),
          half_bits_(static_cast<std::uint32_t>(std::bit_width(count - 1) + 1) / 2) {}

    std::uint32_t operator()(std::uint32_t index) const {
        if (key_ == 0) return index;
        std::uint64_t value = index;
        do {
            value = encrypt(value);
        } while (value >= count_);
        return static_cast<std::uint32_t>(value);
    }

private:
    std::uint64_t encrypt(std::uint64_t value) const {
        const std::uint64_t mask = (std::uint64_t{1} << half_bits_) - 1;
        std::uint64_t left = value >> half_bits_;
        std::uint64_t right = value & mask;
        for (std::uint64_t round = 0; round < 4; ++round) {
            const std::uint64_t mixed =
                left ^ (hash_bits(kSeed, 4 * key_ + round + (right << 16)) & mask);
            left = right;
            right = mixed;
        }
        return (left << half_bits_) | right;
    }

    std::uint32_t count_;
    std::uint64_t key_;
    std::uint32_t half_bits_;
};

// A torus: rows go the long way round, columns around the tube.
std::vector<vec3> torus_points(const Grid& grid) {
    std::vector<vec3> points;
    points.reserve(std::size_t{grid.rows} * grid.columns);
    for (std::uint32_t row = 0; row < grid.rows; ++row) {
        const double along = static_cast<double>(row) / grid.rows;
        const CosSin ring = circle_point(along);
        for (std::uint32_t column = 0; column < grid.columns; ++column) {
            const double around = static_cast<double>(column) / grid.columns;
            const double bumps = sin_turns(9 * along) * sin_turns(4 * around + 2 * along);
            const double tube = 0.4 + 0.06 * bumps;
            const double out = 1 + tube * cos_turns(around);
            points.push_back(
                round_to_float({out * ring.cos, out * ring.sin, tube * sin_turns(around)}));
        }
    }
    return points;
}

uvec3 torus_triangle(const Grid& grid, std::uint32_t index) {
    const std::uint32_t row = index / 2 / grid.columns;
    const std::uint32_t column = index / 2 % grid.columns;
    const std::uint32_t next_row = row + 1 == grid.rows ? 0 : row + 1;
    const std::uint32_t next_column = column + 1 == grid.columns ? 0 : column + 1;
    const std::uint32_t a = row * grid.columns + column;
    const std::uint32_t b = next_row * grid.columns + column;
    const std::uint32_t c = next_row * grid.columns + next_column;
    const std::uint32_t d = row * grid.columns + next_column;
    return index % 2 == 0 ? uvec3{a, b, c} : uvec3{a, c, d};
}

}  // namespace shuffle
}  // namespace

DeformingMesh make_shuffle(std::uint64_t triangles) {
    using namespace shuffle;
    const Grid grid = grid_of(static_cast<double>(triangles) / 2, 2, 3, 3);
    const std::uint32_t count = 2 * grid.rows * grid.columns;
    DeformingMesh mesh;
    mesh.topology.vertex_count = 3 * count;
    mesh.topology.triangles.reserve(count);
    for (std::uint32_t i = 0; i < count; ++i) {
        mesh.topology.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    mesh.topology.albedo.assign(count, rgb(196, 122, 40));
    mesh.move = [grid, count, points = torus_points(grid)](double frame, VertexRange range,
                                                           std::span<vec3> out) {
        const Permutation place(count, static_cast<std::uint64_t>(std::floor(frame)));
        uvec3 corners;
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            if (i == range.begin || i % 3 == 0) corners = torus_triangle(grid, place(i / 3));
            out[i] = points[corners[i % 3]];
        }
    };
    return mesh;
}

namespace {
namespace soup {

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

}  // namespace soup
}  // namespace

DeformingMesh make_soup(std::uint64_t triangles) {
    using namespace soup;
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

namespace {
namespace orbits {

constexpr std::uint64_t kSeed = 0x0B17;
constexpr std::uint32_t kMostBalls = 120;
constexpr double kNearest = 0.25;
constexpr double kFarthest = 1.0;
constexpr double kSlowest = 1.0 / 30;
constexpr double kFastest = 1.0 / 12;

struct Ball {
    Sphere sphere;
    std::uint32_t first_vertex;
};

std::vector<Ball> make_balls(std::uint64_t triangles) {
    const std::uint32_t count = std::clamp(cube_root(triangles) * 4, 1u, kMostBalls);
    std::vector<Ball> balls;
    std::uint64_t made = 0;
    std::uint32_t vertices = 0;
    for (std::uint32_t i = 0; i < count && (i == 0 || made < triangles); ++i) {
        // Keeps the total near the request.
        const std::uint64_t due = triangles * (i + 1) / count;
        if (due < made + 6 && i + 1 < count) continue;
        const Ball& ball = balls.emplace_back(Ball{Sphere(std::max(due, made) - made), vertices});
        made += ball.sphere.triangle_count();
        vertices += ball.sphere.vertex_count();
    }
    return balls;
}

glm::dvec3 on_orbit(std::uint32_t ball, double frame) {
    const glm::dvec3 axis = uniform_direction(kSeed, ball, 0);
    const glm::dvec3 any = uniform_direction(kSeed, ball, 2);
    const glm::dvec3 across = glm::cross(axis, any);
    const double radius = kNearest + (kFarthest - kNearest) * uniform(kSeed, ball, 4);
    const double speed = kSlowest + (kFastest - kSlowest) * uniform(kSeed, ball, 5);
    const CosSin turn = circle_point(uniform(kSeed, ball, 6) + speed * frame);
    return rotate(radius / glm::length(across) * across, axis, turn);
}

/// Where a ball stands until the next time that all jump at once: uniform in the unit ball.
glm::dvec3 after_jumps(std::uint32_t ball, double frame) {
    constexpr double kFramesAtRest = 3;
    const auto draw = 8 + 5 * static_cast<std::uint64_t>(std::floor(frame / kFramesAtRest));
    // The largest of three is spread like a cube root.
    const double radius = std::max({uniform(kSeed, ball, draw), uniform(kSeed, ball, draw + 1),
                                    uniform(kSeed, ball, draw + 2)});
    return radius * uniform_direction(kSeed, ball, draw + 3);
}

using Centre = glm::dvec3 (*)(std::uint32_t ball, double frame);

DeformingMesh make_moving_balls(std::uint64_t triangles, Centre centre_of) {
    const std::vector<Ball> balls = make_balls(triangles);
    DeformingMesh mesh;
    for (std::size_t i = 0; i < balls.size(); ++i) {
        balls[i].sphere.append_to(mesh.topology,
                                  [i](std::uint32_t, std::uint32_t) { return palette(i); });
    }
    const double size = 0.5 / (1 + cube_root(balls.size()));
    mesh.move = [balls, size, centre_of](double frame, VertexRange range, std::span<vec3> out) {
        const auto after = std::upper_bound(
            balls.begin(), balls.end(), range.begin,
            [](std::uint32_t vertex, const Ball& ball) { return vertex < ball.first_vertex; });
        auto index = static_cast<std::uint32_t>(after - balls.begin() - 1);
        for (std::uint32_t begin = range.begin; begin < range.end; ++index) {
            const Ball& ball = balls[index];
            const std::uint32_t end =
                std::min(range.end, ball.first_vertex + ball.sphere.vertex_count());
            const glm::dvec3 centre = centre_of(index, frame);
            for (; begin < end; ++begin) {
                out[begin] = round_to_float(
                    centre + size * ball.sphere.direction(begin - ball.first_vertex));
            }
        }
    };
    return mesh;
}

}  // namespace orbits
}  // namespace

DeformingMesh make_orbits(std::uint64_t triangles) {
    using namespace orbits;
    return make_moving_balls(triangles, on_orbit);
}

DeformingMesh make_teleport(std::uint64_t triangles) {
    using namespace orbits;
    return make_moving_balls(triangles, after_jumps);
}

namespace {
namespace hall {

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
            add_triangle(at(0, 0), at(0, side + 1), at(0, side), albedo);
            add_triangle(at(segments, 0), at(segments, side), at(segments, side + 1), albedo);
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
        mesh_.move = [vertices = std::move(vertices_)](double frame, VertexRange range,
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

    void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, Albedo albedo) {
        mesh_.topology.triangles.push_back({a, b, c});
        mesh_.topology.albedo.push_back(albedo);
    }

    void add_quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d,
                  Albedo albedo) {
        add_triangle(a, b, c, albedo);
        add_triangle(a, c, d, albedo);
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

}  // namespace hall
}  // namespace

DeformingMesh make_hall(std::uint64_t triangles) {
    using namespace hall;
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
