#include <algorithm>
#include <cmath>
#include <vector>

#include "scenes/procedural/parts/colours.h"
#include "scenes/procedural/parts/integer_root.h"
#include "scenes/procedural/parts/random.h"
#include "scenes/procedural/parts/rotation.h"
#include "scenes/procedural/scenes.h"
#include "scenes/trig.h"

namespace mray {
namespace {

constexpr double kLastFrame = 24;
constexpr std::uint64_t kSeed = 0xE84;
constexpr double kInnerRadius = 0.8;
constexpr double kMostSpin = 1.5;  // turns on the way
constexpr double kFarthest = 2.2;
/// How far the chunks are on their way, 0 to 1, at a frame, and how much they turn on it.
struct Way {
    double (*progress)(double frame);
    double most_spin;
};

// A piece of the shell that stands over one of the cells x cells squares of a cube's face: outer
// and inner side of cuts x cuts quads each, and walls. Vertices: the outer grid, then the inner.
struct Chunk {
    std::uint32_t first_vertex = 0;
    std::uint32_t cuts = 1;
    std::uint32_t face = 0;
    std::uint32_t row = 0;
    std::uint32_t column = 0;

    std::uint32_t grid_vertices() const { return (cuts + 1) * (cuts + 1); }
    std::uint32_t triangle_count() const { return 4 * cuts * cuts + 8 * cuts; }
};

struct Shell {
    std::uint32_t cells = 1;  // a side of each face
    std::vector<Chunk> chunks;
};

// From a point of a cube's face, s and t in [-1, 1], to the sphere. Faces 0 to 5: +x -x +y -y +z
// -z; s, t and the outer normal are right-handed.
glm::dvec3 on_sphere(std::uint32_t face, double s, double t) {
    const std::uint32_t axis = face / 2;
    const double sign = face % 2 == 0 ? 1 : -1;
    glm::dvec3 p;
    p[axis] = sign;
    p[(axis + 1) % 3] = sign * s;
    p[(axis + 2) % 3] = t;
    return p / glm::length(p);
}

glm::dvec3 chunk_direction(const Shell& shell, const Chunk& chunk, double row, double column) {
    return on_sphere(chunk.face, 2 * (chunk.column + column) / shell.cells - 1,
                     2 * (chunk.row + row) / shell.cells - 1);
}

Shell make_shell(std::uint64_t triangles) {
    const auto wanted = static_cast<double>(triangles);
    Shell shell;
    // 96 chunks at the default size, some hundreds at a million.
    shell.cells = std::max(1u, (cube_root(triangles) + 5) / 10);
    const std::uint32_t count = 6 * shell.cells * shell.cells;
    std::uint64_t made = 0;
    std::uint32_t vertices = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        Chunk chunk;
        chunk.first_vertex = vertices;
        chunk.face = i / (shell.cells * shell.cells);
        chunk.row = i / shell.cells % shell.cells;
        chunk.column = i % shell.cells;
        // 4 (n + 1)^2 - 4 triangles, which keeps the total near the request.
        const double due = wanted * (i + 1) / count - static_cast<double>(made);
        chunk.cuts = static_cast<std::uint32_t>(
            std::max(1.0, std::round(std::sqrt(std::max(due, 0.0) / 4 + 1) - 1)));
        made += chunk.triangle_count();
        vertices += 2 * chunk.grid_vertices();
        shell.chunks.push_back(chunk);
    }
    return shell;
}

void append_chunk(Topology& topology, const Chunk& chunk, Albedo outside, Albedo inside) {
    const std::uint32_t n = chunk.cuts;
    const auto quad = [&](Albedo albedo, std::uint32_t a, std::uint32_t b, std::uint32_t c,
                          std::uint32_t d) {
        topology.triangles.push_back({a, b, c});
        topology.triangles.push_back({a, c, d});
        topology.albedo.insert(topology.albedo.end(), 2, albedo);
    };
    const auto outer = [&](std::uint32_t row, std::uint32_t column) {
        return chunk.first_vertex + row * (n + 1) + column;
    };
    const auto inner = [&](std::uint32_t row, std::uint32_t column) {
        return outer(row, column) + chunk.grid_vertices();
    };
    for (std::uint32_t i = 0; i < n; ++i) {
        for (std::uint32_t j = 0; j < n; ++j) {
            quad(outside, outer(i, j), outer(i, j + 1), outer(i + 1, j + 1), outer(i + 1, j));
            quad(inside, inner(i, j), inner(i + 1, j), inner(i + 1, j + 1), inner(i, j + 1));
        }
        quad(inside, outer(0, i), inner(0, i), inner(0, i + 1), outer(0, i + 1));
        quad(inside, outer(n, i), outer(n, i + 1), inner(n, i + 1), inner(n, i));
        quad(inside, outer(i, 0), outer(i + 1, 0), inner(i + 1, 0), inner(i, 0));
        quad(inside, outer(i, n), inner(i, n), inner(i + 1, n), outer(i + 1, n));
    }
    topology.vertex_count += 2 * chunk.grid_vertices();
}

void move_chunk(const Shell& shell, std::uint32_t index, double time, double most_spin,
                VertexRange range, std::span<vec3> out) {
    const Chunk& chunk = shell.chunks[index];
    const glm::dvec3 outward = chunk_direction(shell, chunk, 0.5, 0.5);
    const glm::dvec3 middle = 0.5 * (1 + kInnerRadius) * outward;
    const double distance = kFarthest * (0.35 + 0.65 * uniform(kSeed, index, 0));
    glm::dvec3 flight = outward + 0.35 * uniform_direction(kSeed, index, 1);
    flight = flight * (distance * time * (2 - time) / glm::length(flight));
    const glm::dvec3 axis = uniform_direction(kSeed, index, 3);
    const CosSin turn = circle_point(most_spin * uniform(kSeed, index, 5) * time);
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
        const std::uint32_t grid_vertex = (i - chunk.first_vertex) % chunk.grid_vertices();
        const bool inner = i - chunk.first_vertex >= chunk.grid_vertices();
        const std::uint32_t grid_row = grid_vertex / (chunk.cuts + 1);
        const double row = static_cast<double>(grid_row) / chunk.cuts;
        const double column = static_cast<double>(grid_vertex % (chunk.cuts + 1)) / chunk.cuts;
        const glm::dvec3 p =
            (inner ? kInnerRadius : 1.0) * chunk_direction(shell, chunk, row, column);
        out[i] = round_to_float(middle + rotate(p - middle, axis, turn) + flight);
    }
}

DeformingMesh make_burst(std::uint64_t triangles, const Way& way) {
    const Shell shell = make_shell(triangles);
    DeformingMesh mesh;
    for (std::size_t i = 0; i < shell.chunks.size(); ++i) {
        append_chunk(mesh.topology, shell.chunks[i], palette(hash_bits(kSeed, i) >> 8),
                     rgb(226, 150, 70));
    }
    mesh.last_frame = kLastFrame;
    mesh.move = [shell, way](double frame, VertexRange range, std::span<vec3> out) {
        const std::vector<Chunk>& chunks = shell.chunks;
        const auto after = std::upper_bound(
            chunks.begin(), chunks.end(), range.begin,
            [](std::uint32_t vertex, const Chunk& chunk) { return vertex < chunk.first_vertex; });
        auto index = static_cast<std::uint32_t>(after - chunks.begin() - 1);
        for (std::uint32_t begin = range.begin; begin < range.end; ++index) {
            const std::uint32_t chunk_end =
                chunks[index].first_vertex + 2 * chunks[index].grid_vertices();
            const std::uint32_t end = std::min(range.end, chunk_end);
            move_chunk(shell, index, way.progress(frame), way.most_spin, {begin, end}, out);
            begin = end;
        }
    };
    return mesh;
}

}  // namespace

DeformingMesh make_explode(std::uint64_t triangles) {
    return make_burst(triangles, {[](double frame) { return frame / kLastFrame; }, kMostSpin});
}

DeformingMesh make_gather(std::uint64_t triangles) {
    const auto there_and_back = [](double frame) {
        return (1 - cos_turns(frame / kLastFrame)) / 2;
    };
    return make_burst(triangles, {there_and_back, kMostSpin / 2});
}

}  // namespace mray
