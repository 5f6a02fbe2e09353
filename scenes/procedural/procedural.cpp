#include "scenes/procedural/procedural.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cassert>

#include "common/text/text.h"
#include "scenes/procedural/hall.h"

namespace mray {
namespace {
namespace cloth {

constexpr double kRadiansPerTurn = 6.283185307179586476925;
constexpr double kBallRadius = 1;
// The sheet bends around this, a little more than the ball.
constexpr double kDrapeRadius = 1.03;
constexpr double kSheetHalfSide = 1.7;
constexpr double kGroundHalfSide = 2.4;
constexpr double kCheckers = 8;
// The sheet never gets steeper than this: almost a quarter turn.
constexpr double kSteepestTurns = 0.24;

struct Pose {
    double frame, bend, lift, fold_height, wave_height;
    CosSin wide_fold_phase, narrow_fold_phase;
};

Pose pose_at(double frame) {
    const double settled = smooth_step(2, 14, frame);
    return {.frame = frame,
            .bend = (0.13 + 0.87 * settled) / kDrapeRadius,
            .lift = 0.6 * (1 - smooth_step(0, 10, frame)),
            .fold_height = 0.36 * settled,
            .wave_height = 0.16 - 0.1 * settled,
            .wide_fold_phase = circle_point(frame / 24),
            .narrow_fold_phase = circle_point(-frame / 12)};
}

// cos(count * angle + phase).
double wave_around(CosSin angle, int count, CosSin phase) {
    CosSin sum = phase;
    for (int i = 0; i < count; ++i) {
        sum = {sum.cos * angle.cos - sum.sin * angle.sin,
               sum.sin * angle.cos + sum.cos * angle.sin};
    }
    return sum.cos;
}

// The sheet as a bent disc: a point at distance r from the middle goes along an arc of curvature
// pose.bend, then straight down at the steepest angle. Folds and waves stand out from that to the
// outer side only, so the ball stays inside: an arc that touches a smaller circle from outside and
// is less curved encloses it.
glm::dvec3 sheet_point(const Pose& pose, double x, double z) {
    const double r = std::sqrt(x * x + z * z);
    const CosSin angle = r > 0 ? CosSin{x / r, z / r} : CosSin{1, 0};

    const double on_arc = std::min(r, kSteepestTurns * kRadiansPerTurn / pose.bend);
    const double slope_turns = on_arc * pose.bend / kRadiansPerTurn;
    const CosSin slope = circle_point(slope_turns);
    const double straight = r - on_arc;
    const double out = slope.sin / pose.bend + straight * slope.cos;
    const double down = (1 - slope.cos) / pose.bend + straight * slope.sin;

    const double folds = 0.5 + 0.33 * wave_around(angle, 7, pose.wide_fold_phase) +
                         0.17 * wave_around(angle, 11, pose.narrow_fold_phase);
    const double waves = 0.5 + 0.3 * sin_turns(0.45 * x + 0.25 * z - pose.frame / 8) +
                         0.2 * sin_turns(0.7 * z - 0.3 * x - pose.frame / 12);
    const double height =
        pose.fold_height * smooth_step(0.4, 2.2, r) * folds + pose.wave_height * waves;

    const double rim = out + height * slope.sin;
    const double y = kBallRadius + kDrapeRadius + pose.lift - down + height * slope.cos;
    return {rim * angle.cos, y, rim * angle.sin};
}

GridColour checkers(const Grid& grid, Albedo light, Albedo dark) {
    return [grid, light, dark](std::uint32_t row, std::uint32_t column) {
        const auto tile = [](std::uint32_t index, std::uint32_t count) {
            return static_cast<std::uint32_t>(kCheckers * (index + 0.5) / count);
        };
        return (tile(row, grid.rows) + tile(column, grid.columns)) % 2 == 0 ? light : dark;
    };
}

DeformingMesh make(std::uint64_t triangles) {
    const Sheet ground(triangles / 10);
    const Sphere ball(triangles / 5);
    const std::uint64_t rest = ground.triangle_count() + ball.triangle_count();
    const Sheet sheet(triangles > rest ? triangles - rest : 0);

    DeformingMesh mesh;
    ground.append_to(mesh.topology, checkers(ground.grid(), rgb(104, 110, 118), rgb(66, 72, 82)));
    ball.append_to(mesh.topology, [](auto, auto) { return rgb(24, 110, 150); });
    sheet.append_to(mesh.topology, checkers(sheet.grid(), rgb(214, 184, 138), rgb(164, 30, 24)));

    mesh.move = [ground, ball, sheet](double frame, IndexRange range, std::span<vec3> out) {
        const Pose pose = pose_at(frame);
        const std::uint32_t ball_begin = ground.vertex_count();
        const std::uint32_t sheet_begin = ball_begin + ball.vertex_count();
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            if (i < ball_begin) {
                const glm::dvec2 at = kGroundHalfSide * ground.at(i);
                out[i] = round_to_float({at.x, 0, at.y});
            } else if (i < sheet_begin) {
                out[i] = round_to_float(glm::dvec3(0, kBallRadius, 0) +
                                        kBallRadius * ball.direction(i - ball_begin));
            } else {
                const glm::dvec2 at = kSheetHalfSide * sheet.at(i - sheet_begin);
                out[i] = round_to_float(sheet_point(pose, at.x, at.y));
            }
        }
    };
    return mesh;
}

}  // namespace cloth

namespace twist {

constexpr double kMostTurns = 4;
constexpr double kSide = 1;
constexpr std::uint32_t kLayersPerAcross = 4;
constexpr double kHeight = kLayersPerAcross * kSide;
// The part of its cell that a box fills along each axis.
constexpr double kFilled = 0.85;

// layers layers of across x across boxes.
struct Column {
    std::uint32_t across, layers;
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

DeformingMesh make(std::uint64_t triangles) {
    const Column column = column_of((triangles + 6) / 12);
    DeformingMesh mesh;
    mesh.topology.vertex_count = 8 * column.box_count();
    for (std::uint32_t box = 0; box < column.box_count(); ++box) {
        // A colour a quarter of the cross-section, so that the turns show as stripes.
        const std::uint32_t right = 2 * (box % column.across) >= column.across;
        const std::uint32_t front = 2 * (box / column.across % column.across) >= column.across;
        for (const auto& c : kBoxTriangles) {
            append_triangle(mesh.topology, 8 * box + c[0], 8 * box + c[1], 8 * box + c[2],
                            palette(2 * front + right));
        }
    }
    mesh.move = [column](double frame, IndexRange range, std::span<vec3> out) {
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

}  // namespace twist

namespace herd {

constexpr double kGroundHalfSide = 10;
constexpr std::uint64_t kSeed = 0x4E6;

double ground_height(double x, double z) {
    return 0.6 * sin_turns(0.05 * x + 0.02 * z) + 0.3 * sin_turns(0.09 * z - 0.03 * x);
}

// Ellipsoids that look along +x, stand on y = 0 and stay within 1 of the y axis.
struct Ellipsoid {
    glm::dvec3 centre, radii;
    double share;  // of the animal's triangles
    bool fleece;
};
constexpr std::uint32_t kPartCount = 7;
const std::array<Ellipsoid, kPartCount> kParts = {{
    {{0, 0.58, 0}, {0.52, 0.32, 0.3}, 0.44, true},
    {{0.6, 0.8, 0}, {0.22, 0.17, 0.15}, 0.2, false},
    {{-0.52, 0.64, 0}, {0.11, 0.1, 0.1}, 0.08, true},
    {{0.3, 0.2, 0.16}, {0.07, 0.28, 0.07}, 0.07, false},
    {{0.3, 0.2, -0.16}, {0.07, 0.28, 0.07}, 0.07, false},
    {{-0.3, 0.2, 0.16}, {0.07, 0.28, 0.07}, 0.07, false},
    {{-0.3, 0.2, -0.16}, {0.07, 0.28, 0.07}, 0.07, false},
}};
constexpr std::uint32_t kFewestAnimalTriangles = 6 * kPartCount;

// All animals have the same mesh, here around the origin.
struct Body {
    std::vector<Sphere> parts;
    std::vector<glm::dvec3> vertices;
    std::uint32_t triangle_count = 0;
};

Body make_body(double triangles) {
    Body body;
    for (const Ellipsoid& part : kParts) {
        const Sphere& sphere =
            body.parts.emplace_back(static_cast<std::uint64_t>(triangles * part.share));
        body.triangle_count += sphere.triangle_count();
        for (std::uint32_t i = 0; i < sphere.vertex_count(); ++i)
            body.vertices.push_back(part.centre + part.radii * sphere.direction(i));
    }
    return body;
}

// Each walks round in its own square: circle and animal are at most half as wide, so none meet.
constexpr double kMostScale = 0.3;    // of the square's side
constexpr double kLargestAnimal = 2;  // however large the square is
constexpr double kMostCircle = 0.19;  // of the square's side
constexpr double kMostTurnsPerFrame = 2 / kLastFrame;
constexpr double kHop = 0.05;  // of the animal's scale
constexpr double kHopsPerFrame = 0.25;

struct Pasture {
    std::uint32_t squares;  // a side
    double side() const { return 2 * kGroundHalfSide / squares; }
    double scale() const { return std::min(kMostScale * side(), kLargestAnimal); }
};

struct Pose {
    glm::dvec3 position;
    CosSin heading;
};

Pose pose_of(const Pasture& pasture, std::uint32_t animal, double frame) {
    const double side = pasture.side();
    const double x = (animal % pasture.squares + 0.5) * side - kGroundHalfSide;
    const std::uint32_t row = animal / pasture.squares;
    const double z = (row + 0.5) * side - kGroundHalfSide;
    const double circle = (0.4 + 0.6 * uniform(kSeed, animal, 0)) * kMostCircle * side;
    const double pace = (uniform(kSeed, animal, 1) < 0.5 ? -1 : 1) *
                        (0.4 + 0.6 * uniform(kSeed, animal, 2)) * kMostTurnsPerFrame;
    const double turns = uniform(kSeed, animal, 3) + pace * frame;
    const CosSin at = circle_point(turns);
    glm::dvec3 position(x + circle * at.cos, 0, z + circle * at.sin);
    const double hop = 0.5 - 0.5 * cos_turns(kHopsPerFrame * frame + uniform(kSeed, animal, 4));
    position.y = ground_height(position.x, position.z) + 2 * kHop * pasture.scale() * hop;
    // Along the circle, the way it goes.
    const CosSin heading = pace > 0 ? CosSin{-at.sin, at.cos} : CosSin{at.sin, -at.cos};
    return {position, heading};
}

Albedo fleece_colour(std::uint32_t animal) {
    constexpr std::array<Albedo, 4> colours = {rgb(214, 206, 186), rgb(190, 176, 150),
                                               rgb(128, 78, 42), rgb(44, 40, 42)};
    const double draw = uniform(kSeed, animal, 5);
    return colours[draw < 0.5 ? 0 : draw < 0.75 ? 1 : draw < 0.9 ? 2 : 3];
}

glm::dvec3 ground_point(const Sheet& ground, std::uint32_t vertex) {
    const glm::dvec2 at = kGroundHalfSide * ground.at(vertex);
    return {at.x, ground_height(at.x, at.y), at.y};
}

DeformingMesh make(std::uint64_t triangles) {
    // Most animals that look like some: both their number and their detail grow with the request.
    const double moving = 0.43 * static_cast<double>(triangles);
    const double wanted = std::min(0.25 * std::sqrt(moving), moving / kFewestAnimalTriangles);
    const auto animals = static_cast<std::uint32_t>(std::max(1.0, std::floor(wanted)));
    const Body body = make_body(moving / animals);
    const std::uint64_t moving_triangles = std::uint64_t{animals} * body.triangle_count;
    const std::uint64_t rest = triangles - std::min(triangles, moving_triangles);
    Sheet ground(std::max(rest, moving_triangles));
    // A sheet may have up to a tenth fewer than asked for.
    if (ground.triangle_count() < moving_triangles) ground = Sheet(moving_triangles * 5 / 4);
    const Pasture pasture{static_cast<std::uint32_t>(std::ceil(std::sqrt(animals)))};

    DeformingMesh mesh;
    ground.append_to(mesh.topology, [&](std::uint32_t row, std::uint32_t column) {
        const std::uint32_t vertex = row * (ground.grid().columns + 1) + column;
        const double height = ground_point(ground, vertex).y + 0.9;  // 0 to 1.8
        const auto lift = static_cast<std::uint32_t>(std::max(0.0, 40 * height));
        return rgb(40 + lift, 84 + lift / 2, 34);
    });
    for (std::uint32_t animal = 0; animal < animals; ++animal) {
        for (std::uint32_t part = 0; part < kPartCount; ++part) {
            const Albedo albedo = kParts[part].fleece ? fleece_colour(animal) : rgb(58, 44, 40);
            body.parts[part].append_to(mesh.topology, [albedo](auto, auto) { return albedo; });
        }
    }
    mesh.move = [ground, pasture, vertices = body.vertices](double frame, IndexRange range,
                                                            std::span<vec3> out) {
        const std::uint32_t ground_end = std::min(range.end, ground.vertex_count());
        for (std::uint32_t i = range.begin; i < ground_end; ++i)
            out[i] = round_to_float(ground_point(ground, i));
        const auto per_animal = static_cast<std::uint32_t>(vertices.size());
        std::uint32_t i = std::max(range.begin, ground.vertex_count());
        while (i < range.end) {
            const std::uint32_t animal = (i - ground.vertex_count()) / per_animal;
            const std::uint32_t first = ground.vertex_count() + animal * per_animal;
            const std::uint32_t end = std::min(range.end, first + per_animal);
            const Pose pose = pose_of(pasture, animal, frame);
            for (; i < end; ++i) {
                const glm::dvec3 p = pasture.scale() * vertices[i - first];
                out[i] = round_to_float(
                    pose.position + glm::dvec3(pose.heading.cos * p.x - pose.heading.sin * p.z, p.y,
                                               pose.heading.sin * p.x + pose.heading.cos * p.z));
            }
        }
    };
    return mesh;
}

}  // namespace herd

namespace shuffle {

constexpr std::uint64_t kSeed = 0x5F1;

// Where a permutation of [0, count) takes an index; key 0 is the identity. Based on: John Black,
// Phillip Rogaway. Ciphers with arbitrary finite domains. CT-RSA 2002: a Feistel network over the
// next even power of two, repeated until the value is in range (fewer than 4 times on average).
std::uint32_t permuted(std::uint32_t index, std::uint32_t count, std::uint64_t key) {
    if (key == 0) return index;
    const auto half_bits = static_cast<std::uint32_t>(std::bit_width(count - 1) + 1) / 2;
    const std::uint64_t mask = (std::uint64_t{1} << half_bits) - 1;
    std::uint64_t value = index;
    do {
        std::uint64_t left = value >> half_bits;
        std::uint64_t right = value & mask;
        for (std::uint64_t round = 0; round < 4; ++round) {
            const std::uint64_t mixed = hash_bits(kSeed, 4 * key + round + (right << 16)) & mask;
            left = std::exchange(right, left ^ mixed);
        }
        value = (left << half_bits) | right;
    } while (value >= count);
    return static_cast<std::uint32_t>(value);
}

// A torus: rows go the long way round, columns around the tube.
std::vector<vec3> torus_points(const Grid& grid) {
    std::vector<vec3> points;
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
    const auto at = [&](std::uint32_t down, std::uint32_t right) {
        return (row + down) % grid.rows * grid.columns + (column + right) % grid.columns;
    };
    return index % 2 == 0 ? uvec3{at(0, 0), at(1, 0), at(1, 1)}
                          : uvec3{at(0, 0), at(1, 1), at(0, 1)};
}

DeformingMesh make(std::uint64_t triangles) {
    const Grid grid = grid_of(static_cast<double>(triangles) / 2, 2, 3, 3);
    const std::uint32_t count = 2 * grid.rows * grid.columns;
    DeformingMesh mesh;
    for (std::uint32_t i = 0; i < count; ++i)
        append_triangle(mesh.topology, 3 * i, 3 * i + 1, 3 * i + 2, rgb(196, 122, 40));
    mesh.topology.vertex_count = 3 * count;
    mesh.move = [grid, count, points = torus_points(grid)](double frame, IndexRange range,
                                                           std::span<vec3> out) {
        const auto key = static_cast<std::uint64_t>(std::floor(frame));
        uvec3 corners;
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            if (i == range.begin || i % 3 == 0)
                corners = torus_triangle(grid, permuted(i / 3, count, key));
            out[i] = points[corners[i % 3]];
        }
    };
    return mesh;
}

}  // namespace shuffle

namespace soup {

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
    glm::dvec3 centre, axis;
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

DeformingMesh make(std::uint64_t triangles) {
    const auto count = static_cast<std::uint32_t>(std::max<std::uint64_t>(1, triangles));
    // Corners in a cube as wide as the space that each triangle has for itself.
    const double size = std::min(kLargest, 1.0 / cube_root(count));
    DeformingMesh mesh;
    for (std::uint32_t i = 0; i < count; ++i) {
        append_triangle(mesh.topology, 3 * i, 3 * i + 1, 3 * i + 2,
                        palette(hash_bits(kSeed, i) >> 8));
    }
    mesh.topology.vertex_count = 3 * count;
    mesh.move = [size](double frame, IndexRange range, std::span<vec3> out) {
        Flight flight{};
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            if (i == range.begin || i % 3 == 0) flight = flight_of(i / 3, frame);
            const glm::dvec3 corner = size * in_cube(i, 13);
            out[i] = round_to_float(flight.centre + rotate(corner, flight.axis, flight.turn));
        }
    };
    return mesh;
}

}  // namespace soup

namespace spikes {

constexpr std::uint32_t kSpikeCount = 48;
constexpr double kShortest = 0.2;
constexpr double kGrowth = 0.8;
constexpr double kPulseFrames = 8;
// Chord from a spike's axis to its foot on the unit sphere: half the distance of its neighbours.
constexpr double kFootRadius = 0.27;

// Spread evenly: a Fibonacci lattice, each direction a golden section of a turn from the last.
std::array<glm::dvec3, kSpikeCount> spike_directions() {
    constexpr double kGoldenTurn = 0.38196601125010515;
    std::array<glm::dvec3, kSpikeCount> directions;
    for (std::uint32_t i = 0; i < kSpikeCount; ++i) {
        const double y = 1 - (2 * i + 1.0) / kSpikeCount;
        const CosSin around = circle_point(kGoldenTurn * i);
        const double ring = std::sqrt(1 - y * y);
        directions[i] = {ring * around.cos, y, ring * around.sin};
    }
    return directions;
}

// The spike that a direction belongs to, and its height there: 1 on its axis, 0 from its foot on.
struct Slope {
    std::uint32_t spike;
    float height;
};

Slope slope_at(const std::array<glm::dvec3, kSpikeCount>& spikes, const glm::dvec3& direction) {
    std::uint32_t nearest = 0;
    double cosine = -1;
    for (std::uint32_t i = 0; i < kSpikeCount; ++i) {
        const double c = glm::dot(spikes[i], direction);
        if (c > cosine) {
            cosine = c;
            nearest = i;
        }
    }
    const double chord = std::sqrt(std::max(0.0, 2 - 2 * cosine));
    const double rise = std::max(0.0, 1 - chord / kFootRadius);
    return {nearest, static_cast<float>(rise * rise)};
}

DeformingMesh make(std::uint64_t triangles) {
    const Sphere sphere(triangles);
    const auto spikes = spike_directions();
    std::vector<Slope> slopes;
    for (std::uint32_t i = 0; i < sphere.vertex_count(); ++i)
        slopes.push_back(slope_at(spikes, sphere.direction(i)));

    DeformingMesh mesh;
    sphere.append_to(mesh.topology, [&](std::uint32_t row, std::uint32_t column) {
        const Slope& slope = slopes[sphere.vertex(row, column)];
        return slope.height > 0.02f ? palette(slope.spike) : rgb(150, 144, 130);
    });
    // The radius is a positive function of the direction, so the ball is star-shaped.
    mesh.move = [sphere, slopes = std::move(slopes)](double frame, IndexRange range,
                                                     std::span<vec3> out) {
        std::array<double, kSpikeCount> length;
        for (std::uint32_t i = 0; i < kSpikeCount; ++i) {
            const double pulse = 0.5 + 0.5 * cos_turns(frame / kPulseFrames + 0.37 * i);
            length[i] = kShortest + kGrowth * pulse;
        }
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            const double height = slopes[i].height;
            out[i] = round_to_float((1 + length[slopes[i].spike] * height) * sphere.direction(i));
        }
    };
    return mesh;
}

}  // namespace spikes

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

DeformingMesh make(std::uint64_t triangles, Centre centre_of) {
    const std::vector<Ball> balls = make_balls(triangles);
    DeformingMesh mesh;
    for (std::size_t i = 0; i < balls.size(); ++i)
        balls[i].sphere.append_to(mesh.topology, [i](auto, auto) { return palette(i); });
    const double size = 0.5 / (1 + cube_root(balls.size()));
    mesh.move = [balls, size, centre_of](double frame, IndexRange range, std::span<vec3> out) {
        const auto after = std::ranges::upper_bound(balls, range.begin, {}, &Ball::first_vertex);
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

// Vertices that one task moves: some 0.1 ms of work.
constexpr std::uint32_t kGrain = 4096;

class ProceduralAnimation final : public Animation {
public:
    ProceduralAnimation(const std::string& name, DeformingMesh mesh)
        : Animation(name), move_(std::move(mesh.move)) {
        topology_ = std::move(mesh.topology);
        smooth_corners_ = topology_.triangles;
        last_frame_ = kLastFrame;
        inside_view_ = mesh.inside_view;
        is_builtin_ = true;
        std::vector<vec3> first(topology_.vertex_count);
        ProceduralAnimation::positions(0, first);
        set_bounds(first);
    }

    void positions(double frame, std::span<vec3> out) const override {
        assert(out.size() == topology_.vertex_count);
        using Range = tbb::blocked_range<std::uint32_t>;
        tbb::parallel_for(Range(0, topology_.vertex_count, kGrain), [&](const Range& block) {
            move_(std::clamp(frame, 0.0, kLastFrame), {block.begin(), block.end()}, out);
        });
    }

private:
    decltype(DeformingMesh::move) move_;
};

constexpr std::array kScenes = {
    ProceduralScene{"cloth", "a sheet that comes down waving over a ball", 60000, cloth::make},
    ProceduralScene{"twist", "a column of boxes twisted by up to 4 turns", 40000, twist::make},
    ProceduralScene{"herd", "animals walking on static hills", 80000, herd::make},
    ProceduralScene{"shuffle", "a torus whose triangles change places", 40000, shuffle::make},
    ProceduralScene{"soup", "separate small triangles in motion", 30000, soup::make},
    ProceduralScene{"spikes", "a closed ball with pulsing spikes", 60000, spikes::make},
    ProceduralScene{"orbits", "balls on crossing orbits", 40000,
                    [](std::uint64_t n) { return orbits::make(n, orbits::on_orbit); }},
    ProceduralScene{"teleport", "balls that jump elsewhere all at once", 40000,
                    [](std::uint64_t n) { return orbits::make(n, orbits::after_jumps); }},
    ProceduralScene{"hall", "a hall from inside: columns, cables, banners", 80000, make_hall},
};

}  // namespace

std::span<const ProceduralScene> procedural_scenes() { return kScenes; }

std::unique_ptr<Animation> make_procedural(const std::string& name, std::uint64_t triangles) {
    const auto* const scene = std::ranges::find(kScenes, name, &ProceduralScene::name);
    if (scene == kScenes.end()) {
        throw Error(ErrorKind::kBadArgument,
                    "there is no built-in scene {}; `morphray info` lists them", quote(name));
    }
    if (triangles > kMaxTriangles) {
        throw Error(ErrorKind::kLimit,
                    "{} triangles are too many for the built-in scene '{}'; ask for {} at most",
                    triangles, name, kMaxTriangles);
    }
    if (triangles == 0) triangles = scene->default_triangles;
    return std::make_unique<ProceduralAnimation>(name, scene->make(triangles));
}

}  // namespace mray
