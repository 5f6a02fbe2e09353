#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "scenes/procedural/helpers.h"
#include "scenes/procedural/procedural.h"
#include "scenes/trig.h"

namespace mray {
namespace {

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

}  // namespace

DeformingMesh make_herd(std::uint64_t triangles) {
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

}  // namespace mray
