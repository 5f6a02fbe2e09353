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

std::vector<vec3> torus_points(const Torus& torus) {
    std::vector<vec3> points;
    points.reserve(torus.vertex_count());
    for (std::uint32_t row = 0; row < torus.grid().rows; ++row) {
        const double along = static_cast<double>(row) / torus.grid().rows;
        const CosSin ring = circle_point(along);
        for (std::uint32_t column = 0; column < torus.grid().columns; ++column) {
            const double around = static_cast<double>(column) / torus.grid().columns;
            const double bumps = sin_turns(9 * along) * sin_turns(4 * around + 2 * along);
            const double tube = 0.4 + 0.06 * bumps;
            const double out = 1 + tube * cos_turns(around);
            points.push_back(
                round_to_float({out * ring.cos, out * ring.sin, tube * sin_turns(around)}));
        }
    }
    return points;
}

}  // namespace

DeformingMesh make_shuffle(std::uint64_t triangles) {
    const Torus torus(triangles, 2);
    const std::uint32_t count = torus.triangle_count();
    DeformingMesh mesh;
    mesh.topology.vertex_count = 3 * count;
    mesh.topology.triangles.reserve(count);
    for (std::uint32_t i = 0; i < count; ++i) {
        mesh.topology.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    mesh.topology.albedo.assign(count, rgb(196, 122, 40));
    mesh.move = [torus, count, points = torus_points(torus)](double frame, VertexRange range,
                                                             std::span<vec3> out) {
        const Permutation place(count, static_cast<std::uint64_t>(std::floor(frame)));
        uvec3 corners;
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            if (i == range.begin || i % 3 == 0) corners = torus.triangle(place(i / 3));
            out[i] = points[corners[i % 3]];
        }
    };
    return mesh;
}

}  // namespace mray
