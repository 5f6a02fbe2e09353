// Queries about all triangles of a backend's scene: all hits of rays, windings around points,
// closest points. Answers are pure functions of query and triangles, the same bits everywhere.
#pragma once

#include <compare>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "common/base/watch.h"
#include "common/bvh/exact_closest.h"
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

// The queries of a batch, in scene space. Spans of a query have one size. Points are finite, those
// of ClosestQuery within kOriginExtent. `sees`, unless null, selects the triangles that count for a
// ray or point. `hides`, unless null, tells which subtrees have none of these, so that tracers skip
// them. Devices ignore both. A watch can cancel before each ray and point on the CPU, and before
// each hit of lists on a device: Error(kCancelled) leaves any answers.

/// Counts the hits of each ray; adds kTouchesBorder.
struct CountQuery {
    std::span<const Ray> rays;
    Crossing crossing;
    std::span<std::uint64_t> counts;
    Watch watch = {};
};

/// Appends to `lists` the first `most` hits of each ray.
struct ListQuery {
    std::span<const Ray> rays;
    Crossing crossing;
    std::uint32_t most;
    HitLists& lists;
    Watch watch = {};
    const SeesTriangle* sees = nullptr;
    const HidesSubtree* hides = nullptr;
};

/// Finds the first hit of each ray after its cursor.
struct NextQuery {
    std::span<const Ray> rays;
    std::span<const HitCursor> after;
    Crossing crossing;
    std::span<Hit> hits;
    Watch watch = {};
    const SeesTriangle* sees = nullptr;
    const HidesSubtree* hides = nullptr;
};

/// Finds the crossings that floats can decide; `uncertain` gets the others, in any order.
struct WindingQuery {
    std::span<const vec3> points;
    std::span<FloatWinding> windings;
    std::vector<UncertainCrossing>& uncertain;
    Watch watch = {};
    const SeesTriangle* sees = nullptr;
    const HidesSubtree* hides = nullptr;
};

/// The triangles that may exactly be the closest ones of points, for one point after the other.
struct Rivals {
    std::vector<NumberedTriangle> triangles;
    /// Where those of each point end. A point that has too many gets one with kNoPrim.
    std::vector<std::uint32_t> ends;
};

/// Finds the closest triangles whose squared distance is at most `most_d2`. Where `rivals` is not
/// null, tracers on the host append to it instead, and `closest` may be empty; a device knows none.
/// `exact` has the points of rivals before they were rounded.
struct ClosestQuery {
    std::span<const vec3> points;
    float most_d2;
    std::span<ClosestTriangle> closest;
    Watch watch = {};
    Rivals* rivals = nullptr;
    std::span<const dvec3> exact = {};
    const SeesTriangle* sees = nullptr;
    const HidesSubtree* hides = nullptr;
};

using QueryBatch = std::variant<CountQuery, ListQuery, NextQuery, WindingQuery, ClosestQuery>;

}  // namespace mray
