#include "scenes/procedural/surface_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

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
    double frame;
    double bend;
    double lift;
    double fold_height;
    double wave_height;
    CosSin wide_fold_phase;
    CosSin narrow_fold_phase;
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

// -1 to 1 over the grid's rows or columns.
double across(std::uint32_t index, std::uint32_t count) { return 2.0 * index / count - 1; }

GridColour checkers(const Grid& grid, Albedo light, Albedo dark) {
    return [grid, light, dark](std::uint32_t row, std::uint32_t column) {
        const auto tile = [](std::uint32_t index, std::uint32_t count) {
            return static_cast<std::uint32_t>(kCheckers * (index + 0.5) / count);
        };
        return (tile(row, grid.rows) + tile(column, grid.columns)) % 2 == 0 ? light : dark;
    };
}

}  // namespace cloth
}  // namespace

DeformingMesh make_cloth(std::uint64_t triangles) {
    using namespace cloth;
    const Sheet ground(triangles / 10);
    const Sphere ball(triangles / 5);
    const std::uint64_t rest = ground.triangle_count() + ball.triangle_count();
    const Sheet sheet(triangles > rest ? triangles - rest : 0);

    DeformingMesh mesh;
    ground.append_to(mesh.topology, checkers(ground.grid(), rgb(104, 110, 118), rgb(66, 72, 82)));
    ball.append_to(mesh.topology, [](auto, auto) { return rgb(24, 110, 150); });
    sheet.append_to(mesh.topology, checkers(sheet.grid(), rgb(214, 184, 138), rgb(164, 30, 24)));

    mesh.move = [ground, ball, sheet](double frame, VertexRange range, std::span<vec3> out) {
        const Pose pose = pose_at(frame);
        const std::uint32_t ball_begin = ground.vertex_count();
        const std::uint32_t sheet_begin = ball_begin + ball.vertex_count();
        const auto on_sheet = [](const Grid& grid, std::uint32_t vertex) {
            return std::pair{across(vertex % (grid.columns + 1), grid.columns),
                             across(vertex / (grid.columns + 1), grid.rows)};
        };
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            if (i < ball_begin) {
                const auto [x, z] = on_sheet(ground.grid(), i);
                out[i] = round_to_float({kGroundHalfSide * x, 0, kGroundHalfSide * z});
            } else if (i < sheet_begin) {
                out[i] = round_to_float(glm::dvec3(0, kBallRadius, 0) +
                                        kBallRadius * ball.direction(i - ball_begin));
            } else {
                const auto [x, z] = on_sheet(sheet.grid(), i - sheet_begin);
                out[i] = round_to_float(sheet_point(pose, kSheetHalfSide * x, kSheetHalfSide * z));
            }
        }
    };
    return mesh;
}

namespace {
namespace herd {

constexpr double kLastFrame = 24;
constexpr double kGroundHalfSide = 10;
constexpr std::uint64_t kSeed = 0x4E6;

double ground_height(double x, double z) {
    return 0.6 * sin_turns(0.05 * x + 0.02 * z) + 0.3 * sin_turns(0.09 * z - 0.03 * x);
}

// Ellipsoids that look along +x, stand on y = 0 and stay within 1 of the y axis.
struct Ellipsoid {
    glm::dvec3 centre;
    glm::dvec3 radii;
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
        for (std::uint32_t i = 0; i < sphere.vertex_count(); ++i) {
            body.vertices.push_back(part.centre + part.radii * sphere.direction(i));
        }
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

glm::dvec3 ground_point(const Grid& grid, std::uint32_t row, std::uint32_t column) {
    const double x = kGroundHalfSide * (2.0 * column / grid.columns - 1);
    const double z = kGroundHalfSide * (2.0 * row / grid.rows - 1);
    return {x, ground_height(x, z), z};
}

}  // namespace herd
}  // namespace

DeformingMesh make_herd(std::uint64_t triangles) {
    using namespace herd;
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
    ground.append_to(mesh.topology,
                     [grid = ground.grid()](std::uint32_t row, std::uint32_t column) {
                         const double height = ground_point(grid, row, column).y + 0.9;  // 0 to 1.8
                         const auto lift = static_cast<std::uint32_t>(std::max(0.0, 40 * height));
                         return rgb(40 + lift, 84 + lift / 2, 34);
                     });
    for (std::uint32_t animal = 0; animal < animals; ++animal) {
        for (std::uint32_t part = 0; part < kPartCount; ++part) {
            const Albedo albedo = kParts[part].fleece ? fleece_colour(animal) : rgb(58, 44, 40);
            body.parts[part].append_to(mesh.topology, [albedo](auto, auto) { return albedo; });
        }
    }
    mesh.last_frame = kLastFrame;
    mesh.move = [ground, pasture, vertices = body.vertices](double frame, VertexRange range,
                                                            std::span<vec3> out) {
        const std::uint32_t stride = ground.grid().columns + 1;
        const std::uint32_t ground_end = std::min(range.end, ground.vertex_count());
        for (std::uint32_t i = range.begin; i < ground_end; ++i) {
            out[i] = round_to_float(ground_point(ground.grid(), i / stride, i % stride));
        }
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

namespace {
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

}  // namespace spikes
}  // namespace

DeformingMesh make_spikes(std::uint64_t triangles) {
    using namespace spikes;
    const Sphere sphere(triangles);
    const auto spikes = spike_directions();
    std::vector<Slope> slopes;
    slopes.reserve(sphere.vertex_count());
    for (std::uint32_t i = 0; i < sphere.vertex_count(); ++i) {
        slopes.push_back(slope_at(spikes, sphere.direction(i)));
    }

    DeformingMesh mesh;
    sphere.append_to(mesh.topology, [&](std::uint32_t row, std::uint32_t column) {
        const std::uint32_t vertex = row == 0 ? 0 : 1 + (row - 1) * sphere.grid().columns + column;
        const Slope& slope = slopes[vertex];
        return slope.height > 0.02f ? palette(slope.spike) : rgb(150, 144, 130);
    });
    // The radius is a positive function of the direction, so the ball is star-shaped.
    mesh.move = [sphere, slopes = std::move(slopes)](double frame, VertexRange range,
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

}  // namespace mray
