#include "app/view/mesh_edit.h"

#include <cmath>

#include <glm/geometric.hpp>

namespace mray::app {
namespace {

/// A number in [-1, 1] from an integer hash (the finaliser of MurmurHash3).
float noise(std::uint32_t x) {
    x ^= x >> 16;
    x *= 0x85ebca6bu;
    x ^= x >> 13;
    x *= 0xc2b2ae35u;
    x ^= x >> 16;
    return static_cast<float>(x) * 0x1p-31f - 1.0f;
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
    if (edit.shake == 0) return;
    const float reach = edit.shake * diagonal;
    std::uint32_t n = edit.shake_seed * 0x9e3779b9u;
    for (vec3& p : positions) {
        p += reach * vec3(noise(n), noise(n + 1), noise(n + 2));
        n += 3;
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
