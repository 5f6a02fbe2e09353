// Questions about all triangles of a backend's scene: all hits of rays, windings around points,
// closest points. Answers are pure functions of question and triangles, the same bits everywhere.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/ray.h"
#include "common/interop/winding_rule.h"

namespace mray {

/// Which triangles a ray hits that goes through an edge or a vertex.
enum class Crossing : std::uint32_t {
    kEach,   // each one there, as closest hits do
    kOwner,  // exactly one of those that it passes through (common/interop/owner_rule.h)
};

/// Hits come after it if (t, prim_id) is greater.
struct HitCursor {
    float t = -1;
    std::uint32_t prim_id = 0;
};

/// The hits of some rays, one ray after the other, each in the order of (t, prim_id).
struct HitLists {
    std::vector<Hit> hits;
    /// For each ray, the hits that are listed, and all that there are.
    std::vector<std::uint32_t> listed;
    std::vector<std::uint64_t> total;

    void clear() {
        hits.clear();
        listed.clear();
        total.clear();
    }
};

/// How a closed mesh lies around a point.
struct PointWinding {
    /// Crossings of a half-line, each with the sign of its side. On the surface, that of a
    /// neighbour of the point.
    std::int32_t winding = 0;
    std::uint32_t crossings = 0;
    /// Whether the point lies on a triangle.
    bool is_on_surface = false;

    /// Adds what exact_crossing() or cross_upwards() returned, for this many equal triangles.
    void add(std::uint32_t crossed, std::uint32_t triangles = 1) {
        const auto times = static_cast<std::int32_t>(triangles);
        winding += (crossed & kCrossesUp) != 0 ? times : (crossed & kCrossesDown) != 0 ? -times : 0;
        crossings += (crossed & (kCrossesUp | kCrossesDown)) != 0 ? triangles : 0;
        is_on_surface |= (crossed & kIsOnTriangle) != 0;
    }

    bool operator==(const PointWinding&) const = default;
};

/// The triangle closest to a point, the lowest prim_id of equally close ones; kNoPrim if there is
/// none within reach. closest_on_triangle() gives the place.
struct ClosestTriangle {
    float d2 = 0;
    std::uint32_t prim_id = kNoPrim;

    bool operator==(const ClosestTriangle&) const = default;
};

/// All in scene space. Spans of a call have one size. Points are finite; those of closest() are
/// within kOriginExtent.
class SceneQueries {
public:
    virtual ~SceneQueries() = default;

    /// Counts the hits of each ray.
    virtual void count(std::span<const Ray> rays, Crossing crossing,
                       std::span<std::uint64_t> counts) const = 0;
    /// Appends to `lists` the first `most` hits of each ray.
    virtual void list(std::span<const Ray> rays, Crossing crossing, std::uint32_t most,
                      HitLists& lists) const = 0;
    /// Finds the first hit of each ray after its cursor.
    virtual void intersect_after(std::span<const Ray> rays, std::span<const HitCursor> after,
                                 Crossing crossing, std::span<Hit> hits) const = 0;
    virtual void wind(std::span<const vec3> points, std::span<PointWinding> windings) const = 0;
    /// Finds the closest triangles whose squared distance is at most `most_d2`.
    virtual void closest(std::span<const vec3> points, float most_d2,
                         std::span<ClosestTriangle> closest) const = 0;
};

}  // namespace mray
