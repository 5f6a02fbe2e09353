#include "accuracy/suspect/aimed_rays.h"

#include <algorithm>
#include <array>
#include <limits>
#include <random>

#include "common/bvh/box.h"
#include "common/scene/scene_space.h"

namespace mray::accuracy {
namespace {

using Place = std::array<double, 3>;

class RayMaker {
public:
    RayMaker(const Topology& topology, std::span<const vec3> positions, std::uint64_t seed)
        : positions_(positions), random_(seed) {
        for (const uvec3& t : topology.triangles) {
            if (!is_valid(t.x) || !is_valid(t.y) || !is_valid(t.z)) continue;
            triangles_.push_back(t);
            for (int corner = 0; corner < 3; ++corner) box_.extend(positions[t[corner]]);
        }
    }

    bool has_triangles() const { return !triangles_.empty(); }

    /// Not valid where the ray would have no direction.
    SceneRay next() {
        const std::size_t kind = made_++;
        const uvec3 t = triangles_[random_() % triangles_.size()];
        const Place target = at(t, kind % 4);
        Place from = origin(t, kind / 4 % 4);
        WorldRay ray{{}, {}, 0, std::numeric_limits<double>::infinity()};
        // Along an axis: from above, below or beside the target.
        constexpr std::size_t kAlongAxis = 8;
        const bool along = kind % kAlongAxis == kAlongAxis - 1;
        const std::size_t axis = kind / kAlongAxis % 3;
        for (std::size_t i = 0; i < 3; ++i) {
            if (along && i != axis) from[i] = target[i];
            ray.org[i] = from[i];
            ray.dir[i] = target[i] - from[i];
        }
        return to_scene(space_, ray);
    }

private:
    bool is_valid(std::uint32_t vertex) const {
        return positions_[vertex] != vec3(kInvalidCoordinate);
    }

    /// A vertex, a point of an edge, the middle of an edge, or a point of the triangle, as floats.
    Place at(const uvec3& t, std::size_t kind) {
        double u = 0;
        if (kind == 1 || kind == 3) u = part();
        if (kind == 2) u = 0.5;
        const double v = kind == 3 ? part() * (1 - u) : 0;
        Place p;
        for (int i = 0; i < 3; ++i) {
            const double a = positions_[t.x][i];
            p[static_cast<std::size_t>(i)] =
                static_cast<float>(a + u * (positions_[t.y][i] - a) + v * (positions_[t.z][i] - a));
        }
        return p;
    }

    /// Outside, in the box of the mesh, in the plane of the triangle, or in a vertex of the mesh.
    Place origin(const uvec3& t, std::size_t kind) {
        if (kind == 3) return at(triangles_[random_() % triangles_.size()], 0);
        const double f = 8 * part() - 4;
        const double g = 8 * part() - 4;
        const double room = kind == 0 ? 1 : 0;
        Place p;
        for (int i = 0; i < 3; ++i) {
            const double a = positions_[t.x][i];
            const double lower = box_.lower[i];
            const double size = box_.upper[i] - lower;
            const double in_room = lower + size * ((1 + 2 * room) * part() - room);
            const double in_plane = a + f * (positions_[t.y][i] - a) + g * (positions_[t.z][i] - a);
            p[static_cast<std::size_t>(i)] = static_cast<float>(kind == 2 ? in_plane : in_room);
        }
        return p;
    }

    /// In [0, 1).
    double part() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

    std::span<const vec3> positions_;
    std::vector<uvec3> triangles_;
    Box box_;
    /// The identity.
    SceneSpace space_{WorldBounds{}};
    std::mt19937_64 random_;
    std::size_t made_ = 0;
};

}  // namespace

std::vector<Ray> aimed_rays(const Topology& topology, std::span<const vec3> positions,
                            std::size_t count, std::uint64_t seed) {
    RayMaker maker(topology, positions, seed);
    std::vector<Ray> rays;
    if (!maker.has_triangles()) return rays;
    for (std::size_t i = 0; i < count; ++i) {
        const SceneRay made = maker.next();
        if (made.valid) rays.push_back(made.ray);
    }
    return rays;
}

}  // namespace mray::accuracy
