#include "app/view/mesh_edit.h"

#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace mray::app {
namespace {

/// Cells of the noise along the scene's diagonal: large against triangles, small against the scene.
constexpr float kCellsADiagonal = 14;

/// A hash of four integers (the finaliser of MurmurHash3 over their sum of products).
std::uint32_t hash(std::uint32_t x, std::uint32_t y, std::uint32_t z, std::uint32_t seed) {
    std::uint32_t h = x * 0x8da6b343u + y * 0xd8163841u + z * 0xcb1ab31fu + seed * 0x9e3779b9u;
    h = (h ^ (h >> 16)) * 0x85ebca6bu;
    h = (h ^ (h >> 13)) * 0xc2b2ae35u;
    return h ^ (h >> 16);
}

/// A vector with components in [-1, 1] from three parts of a hash.
vec3 vector_of(std::uint32_t h) {
    const auto part = [h](int shift) {
        return static_cast<float>(h >> shift & 0x3FFu) / 511.5f - 1.0f;
    };
    return {part(0), part(10), part(20)};
}

/// Vectors at the corners of cells of size 1, and in between their smooth mean: neighbours move
/// together, so that triangles keep their size and boxes do not.
vec3 noise(vec3 p, std::uint32_t seed) {
    const vec3 corner = glm::floor(p);
    const vec3 part = p - corner;
    const vec3 weight = part * part * (3.0f - 2.0f * part);
    vec3 sum(0, 0, 0);
    for (int i = 0; i < 8; ++i) {
        const int x = i & 1;
        const int y = i >> 1 & 1;
        const int z = i >> 2;
        const float w = (x != 0 ? weight.x : 1 - weight.x) * (y != 0 ? weight.y : 1 - weight.y) *
                        (z != 0 ? weight.z : 1 - weight.z);
        const auto cell = [](float c, int add) {
            return static_cast<std::uint32_t>(static_cast<std::int32_t>(c) + add);
        };
        sum += w * vector_of(hash(cell(corner.x, x), cell(corner.y, y), cell(corner.z, z), seed));
    }
    return sum;
}

void pull(const Pull& pull, std::span<vec3> positions) {
    if (pull.vertex >= positions.size() || !(pull.radius > 0)) return;
    const vec3 centre = positions[pull.vertex];
    for (vec3& p : positions) {
        const float part = glm::distance(p, centre) / pull.radius;
        if (!(part < 1)) continue;
        const float rest = 1 - part * part;
        p += pull.offset * (rest * rest);
    }
}

}  // namespace

void apply(const MeshEdit& edit, float diagonal, std::span<vec3> positions) {
    for (const Pull& one : edit.pulls) pull(one, positions);
    if (edit.shake == 0 || !(diagonal > 0)) return;
    const float cells_a_length = kCellsADiagonal / diagonal;
    const float reach = edit.shake * diagonal;
    // Farther away a cell has no number, and the vertex stays.
    constexpr float kMostCells = 0x1p30f;
    for (vec3& p : positions) {
        const vec3 cell = p * cells_a_length;
        if (!(glm::length(cell) < kMostCells)) continue;
        p += reach * noise(cell, edit.shake_seed);
    }
}

EditedClip::EditedClip(const Clip& clip)
    : clip_(clip), diagonal_(static_cast<float>(diagonal_of(clip.bounds()))) {}

void EditedClip::positions(double frame, std::span<vec3> out) const {
    clip_.positions(frame, out);
    apply(edit_, diagonal_, out);
}

double diagonal_of(const WorldBounds& bounds) {
    if (bounds.empty()) return 0;
    return std::hypot(bounds.upper[0] - bounds.lower[0], bounds.upper[1] - bounds.lower[1],
                      bounds.upper[2] - bounds.lower[2]);
}

}  // namespace mray::app
