// Queries about all triangles of a backend's scene: all hits of rays, windings around points,
// closest points. Answers are pure functions of query and triangles, the same bits everywhere.
#pragma once

#include <cmath>
#include <compare>
#include <type_traits>
#include <variant>

#include "common/base/watch.h"
#include "common/bvh/exact_closest.h"
#include "common/interop/constants.h"
#include "common/interop/ray.h"

namespace mray {

/// Which triangles a ray hits that goes through an edge or a vertex.
enum class Crossing : std::uint32_t {
    kEach,   // each one there, as closest hits do
    kOwner,  // exactly one of those that it passes through (common/interop/tie_break_rule.h)
};

/// Added to the number of a ray's hits if one of them may go through an edge or a vertex of
/// its triangle (may_touch_border() of common/interop/tie_break_rule.h).
inline constexpr std::uint64_t kTouchesBorder = std::uint64_t{1} << 63;

/// Hits come after it if (t, prim_id) is greater.
struct HitCursor {
    float t = -1;
    std::uint32_t prim_id = 0;
};

/// The hits of some rays, one ray after the other, each in the order of (t, prim_id).
struct HitLists {
    std::vector<Hit> hits;
    /// For each ray, the hits that are listed, and all that there are, with kTouchesBorder.
    std::vector<std::uint32_t> listed;
    std::vector<std::uint64_t> total;
};

/// Crossings of the half-line along +z that floats can decide (common/interop/winding_rule.h).
struct FloatWinding {
    /// Each crossing with the sign of its side.
    std::int32_t winding = 0;
    std::uint32_t crossings = 0;

    bool operator==(const FloatWinding&) const = default;
};

/// A triangle that floats cannot decide on for a point.
struct UncertainCrossing {
    std::uint32_t point, prim_id;

    auto operator<=>(const UncertainCrossing&) const = default;
};

/// More than any squared distance in scene space.
inline constexpr float kAnyDistance2 = 0x1p+90f;

/// The triangle closest to a point, the lowest prim_id of equally close ones; kNoPrim if there is
/// none within reach. triangle_distance2() says how far.
struct ClosestTriangle {
    float d2 = 0;
    std::uint32_t prim_id = kNoPrim;

    bool operator==(const ClosestTriangle&) const = default;
};

/// The triangles that exist for the rays or points of a query, by their numbers in it.
struct TriangleFilter {
    std::function<bool(std::size_t asked, std::uint32_t prim_id)> sees;
    /// True if no triangle of a subtree exists: that of a node of the host's tree, or that of leaf
    /// i, whose number is i after those of all nodes. Empty if that is not known.
    std::function<bool(std::size_t asked, std::size_t subtree)> hides = {};
};

// The queries of a batch, in scene space. Spans of a query have one size. Points are finite, those
// about closest triangles within kOriginExtent. A filter, unless null, selects triangles; tracers
// may skip what it hides. A watch ends a query soon, within a few rays and points, or some
// milliseconds of a device, by Error(kCancelled), which leaves any answers.

/// Counts the hits of each ray; adds kTouchesBorder.
struct CountQuery {
    std::span<const Ray> rays;
    Crossing crossing;
    std::span<std::uint64_t> counts;
    Watch watch = {};
    const TriangleFilter* filter = nullptr;
};

/// Appends to `lists` the first `most` hits of each ray.
struct ListQuery {
    std::span<const Ray> rays;
    Crossing crossing;
    std::uint32_t most;
    HitLists& lists;
    Watch watch = {};
    const TriangleFilter* filter = nullptr;
};

/// Finds the first hit of each ray after its cursor.
struct NextQuery {
    std::span<const Ray> rays;
    std::span<const HitCursor> after;
    Crossing crossing;
    std::span<Hit> hits;
    Watch watch = {};
    const TriangleFilter* filter = nullptr;
};

/// Finds the crossings that floats can decide; `uncertain` gets the others, in any order.
struct WindingQuery {
    std::span<const vec3> points;
    std::span<FloatWinding> windings;
    std::vector<UncertainCrossing>& uncertain;
    Watch watch = {};
    const TriangleFilter* filter = nullptr;
};

/// Finds the closest triangles by the rule, whose squared distance is at most `most_d2`.
struct ClosestQuery {
    std::span<const vec3> points;
    float most_d2;
    std::span<ClosestTriangle> closest;
    Watch watch = {};
    const TriangleFilter* filter = nullptr;
};

/// The largest coordinate of points whose closest triangle is looked for in floats first.
inline constexpr double kMostPoint = 4 * double{kSceneExtent};
inline bool is_within(const dvec3& p) {
    return std::abs(p.x) <= kMostPoint && std::abs(p.y) <= kMostPoint &&
           std::abs(p.z) <= kMostPoint;
}

/// Finds the closest triangle of each point of `exact`, in exact arithmetic: the lowest prim_id of
/// equally close ones, or kNoPrim. Triangles whose squared distance by the rule is above `most_d2`
/// need not be found.
/// `points` are `exact` in floats; beyond kMostPoint any floats beyond it on the same side.
struct ExactClosestQuery {
    std::span<const vec3> points;
    std::span<const dvec3> exact;
    float most_d2;
    std::span<NumberedTriangle> closest;
    Watch watch = {};
    const TriangleFilter* filter = nullptr;
};

/// Queries that devices answer if they see all triangles.
template <class Query>
inline constexpr bool kIsForDevices = !std::is_same_v<Query, ExactClosestQuery>;
/// Whether the host answers a query for a device, as it does for points that do not see all.
template <class Query>
constexpr bool is_for_host(bool is_filtered) {
    return !kIsForDevices<Query> || (is_filtered && requires(Query query) { query.points; });
}

using QueryBatch =
    std::variant<CountQuery, ListQuery, NextQuery, WindingQuery, ClosestQuery, ExactClosestQuery>;

}  // namespace mray
