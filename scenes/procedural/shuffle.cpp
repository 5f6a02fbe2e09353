#include <bit>
#include <cmath>
#include <vector>

#include "scenes/procedural/helpers.h"
#include "scenes/procedural/procedural.h"
#include "scenes/trig.h"

namespace mray {
namespace {

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

}  // namespace

DeformingMesh make_shuffle(std::uint64_t triangles) {
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

}  // namespace mray
