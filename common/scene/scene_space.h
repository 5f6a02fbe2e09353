// Scene space, where the hit rule is exact. Nothing else knows scale and grid.
#pragma once

#include <limits>

#include <glm/ext/vector_double3.hpp>

#include "common/interop/camera.h"
#include "common/interop/platform.h"
#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace mray {

/// Bounds of points, in double so that no extent of floats overflows. Empty: lower > upper.
struct WorldBounds {
    glm::dvec3 lower = {1, 1, 1};
    glm::dvec3 upper = {-1, -1, -1};
    bool empty() const { return lower.x > upper.x; }
    void extend(const WorldBounds& other);
};

/// The bounds of the finite points.
WorldBounds bounds_of(std::span<const vec3> points);

/// The map between world space and scene space: scene = (world - centre) * 2^exponent, rounded
/// once to float and snapped to the grid of 2^-40. The exponent brings the animation's bounds into
/// [-2^20, 2^20]. centre is 0 on an axis unless the animation lies so far to one side of 0 that
/// world - centre is exact for every float in the bounds (Sterbenz's lemma), so the map of every
/// vertex of at least 2^-36 of the extent is exact and exactly invertible.
class SceneSpace {
public:
    /// Empty bounds give the identity. A vertex with a coordinate beyond `limit` is left out.
    explicit SceneSpace(const WorldBounds& bounds, float limit = std::numeric_limits<float>::max());

    bool operator==(const SceneSpace&) const = default;

    int exponent() const { return exponent_; }
    /// The origin of scene space, in world space.
    double centre(int axis) const { return centre_[axis]; }
    float limit() const { return limit_; }
    /// False for a vertex that is not finite or has a coordinate beyond the limit.
    bool keeps(vec3 world) const;

    /// A vertex that is not finite or is left out becomes kInvalidCoordinate on all axes.
    vec3 to_scene(vec3 world) const;
    /// `world` and `scene` have the same size and may be the same memory.
    void to_scene(std::span<const vec3> world, std::span<vec3> scene) const;
    vec3 to_world(vec3 scene) const;

    /// Converts a length to scene space and back; exact unless it overflows.
    double length_to_scene(double world) const { return world * scale_; }
    double length_to_world(double scene) const { return scene / scale_; }

    /// A point such as an eye or a light, which may lie outside the bounds. Throws Error(kBadInput)
    /// that names `what` if it is not finite or farther than 2^20 extents.
    vec3 point_to_scene(const glm::dvec3& world, const char* what) const;

private:
    glm::dvec3 centre_ = {0, 0, 0};
    int exponent_ = 0;
    double scale_ = 1;  // 2^exponent_
    float limit_;
};

/// Vertices of a pose are left out if a coordinate is more than 2^kFarExponent times as large as
/// those of most: otherwise the grid of scene space would move these by more than 2^-24.
inline constexpr int kFarExponent = 37;
/// Vertices this much nearer to the origin than most would keep less than eight bits.
inline constexpr int kLostExponent = 52;

/// The size of a pose: counts and bounds of its finite vertices by the power of two that holds
/// their largest coordinate. Sums of integers and bounds do not depend on the order of threads.
class PoseExtent {
public:
    PoseExtent() = default;
    /// The vertices that triangles use (used_vertices()).
    PoseExtent(std::span<const vec3> world, std::span<const IndexRange> used);

    void add(std::span<const vec3> world);
    void extend(const PoseExtent& other);

    /// The coordinate beyond which vertices are left out, from the least power of two that holds
    /// more than half of the vertices that are not at 0; at least the power of two that holds the
    /// space of `reference`. If that half is 2^kLostExponent beyond the reference, where some of
    /// the others are, that of the reference counts. The largest float if no vertex is beyond the
    /// limit.
    float limit(const WorldBounds& reference = {}) const;
    WorldBounds bounds(float limit) const;
    /// Counts finite vertices.
    std::uint64_t count_beyond(float limit) const;

private:
    struct Bin {
        std::uint64_t count = 0;
        vec3 lower = vec3(std::numeric_limits<float>::infinity());
        vec3 upper = vec3(-std::numeric_limits<float>::infinity());
    };
    /// Bin i has the vertices up to 2^(i - 127).
    std::array<Bin, 256> bins_;
};

/// The bounds of the vertices of a first pose that are not left out. Where most are so far away
/// that others would be lost, those near at least half of the parts, such as meshes, count instead.
WorldBounds bounds_of_parts(const PoseExtent& all, std::vector<WorldBounds> parts);

/// The space of a pose: that of `reference`, the bounds of an animation or scene, as long as all
/// vertices lie in its range; otherwise that of both together. Vertices beyond that range and
/// PoseExtent::limit() are left out. Without a reference the pose is its own.
SceneSpace space_of_pose(const WorldBounds& reference, const PoseExtent& pose);

/// A ray in world space as read from a file, made fit for the hit rule.
struct WorldRay {
    glm::dvec3 org, dir;
    double tnear, tfar;
};

/// Rays from farther away on an axis are moved along themselves to the scene: 2^10 extents.
inline constexpr float kFarOrigin = 0x1p+30f;

/// A ray in scene space; world_t = t_start + ray_t * 2^t_exponent, and t_start is 0 unless the
/// origin is far away. `valid` is false for a ray that is not finite, has no direction or an empty
/// interval, or leads from far away past the scene: it hits nothing.
struct SceneRay {
    Ray ray;
    int t_exponent = 0;
    double t_start = 0;
    bool valid = false;
};
SceneRay to_scene(const SceneSpace& space, const WorldRay& ray);

/// A ray in the caller's own space: org + t * dir for t > 0 in [tnear, tfar].
struct StoredRay {
    float org[3];
    float tnear;
    float dir[3];
    float tfar;
};
static_assert(sizeof(StoredRay) == 32);

/// The sides of a tile of stored rays are multiples of kStoredTileStep, up to kStoredTileSide.
inline constexpr std::uint32_t kStoredTileStep = 8;
inline constexpr std::uint32_t kStoredTileSide = 64;

/// Ray (x, y) is rays[y * stride + x]. All may start at one point, which is `org` in scene space.
struct StoredRayTile {
    const StoredRay* rays;
    std::size_t stride;
    std::uint32_t width, height;
    vec3 org;
};

/// The 0 of world space in the coordinates of files and of callers' doubles, which may lie so far
/// from 0 that floats are too coarse for them.
struct Origin {
    glm::dvec3 at = {0, 0, 0};
    bool operator==(const Origin&) const = default;

    /// Rounded once to float, beyond floats to an infinity.
    vec3 to_world(const glm::dvec3& given) const;
    std::vector<vec3> to_world(std::span<const glm::dvec3> given) const;
    glm::dvec3 from_world(const glm::dvec3& world) const {
        // -0 stays -0.
        return at == glm::dvec3(0.0) ? world : world + at;
    }

    /// The farthest that to_world() moves a coordinate. Ignores points that are not finite, beyond
    /// 1e30, or 2^37 times as far from 0 as most.
    double rounding_of(std::span<const glm::dvec3> given) const;
    /// Whether that is more than 1e-6 of the extent of all points.
    bool rounds_coarsely(std::span<const glm::dvec3> given) const;

    /// The digits that a given coordinate is printed with.
    int digits() const { return *this == Origin() ? 9 : 12; }
};

/// The centre of points in whole steps of a power of two of about their extent, so that subtracting
/// it is exact.
Origin centre_of(std::span<const glm::dvec3> given);
/// The origin for the points of a first frame: 0, or their centre if that alone rounds finely.
Origin origin_of(std::span<const glm::dvec3> given);

}  // namespace mray
