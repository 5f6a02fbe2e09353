// Decides exactly what a ray hits, and classifies answers (docs/guide/accuracy.md).
#pragma once

#include <glm/vec3.hpp>

#include "common/interop/ray.h"
#include "lab/methods/peer_tree.h"

namespace mray::lab {

using glm::dvec3;

/// The intersection of a ray with a triangle in homogeneous form. With a, b, c the corners relative
/// to the origin and d the direction,
///     u = d . (b x c),   v = d . (c x a),   w = d . (a x b),   t = a . (b x c) / (u + v + w).
/// They are computed in double with a bound of their errors (as J. R. Shewchuk. Adaptive precision
/// floating-point arithmetic and fast robust geometric predicates. 1997, stage A), and by integers
/// of any length (GMP) if that does not decide.
class ExactTriangle {
public:
    /// Any finite floats.
    ExactTriangle(const Ray& ray, vec3 a, vec3 b, vec3 c);

    /// Edges and corners included; not if the line lies in the plane, nor if there is no area.
    bool is_met() const;
    /// Whether t is above 0 and within [tnear, tfar]. Only for a triangle that is met.
    bool in_range() const;
    /// The sign of t - other.t, exactly. Only for triangles whose planes the line crosses.
    int compare_t(const ExactTriangle& other) const;

    /// Whether the line crosses the plane, so that there is a t.
    bool has_t() const;
    /// t of the plane, to 2^-27 of itself.
    double t() const;
    /// t, and the weights u and v of the corners b and c: t to 2^-33 of itself, the others to
    /// 2^-33. Only for triangles whose planes the line crosses.
    dvec3 hit() const;
    /// How near the line is to the nearest edge, as a part of size(); in double.
    double edge_distance() const;
    /// The largest distance of a corner from the line.
    double size() const;

    /// How often the calling thread has needed integers.
    static std::uint64_t exact_count();

private:
    struct Integers;

    int sign(std::size_t i) const;
    /// Value i divided by the sum of u, v and w; an error of at most 2 * precise.
    double over_sum(std::size_t i, double precise) const;
    int compare_t(float limit) const;
    const Integers& integers() const;

    Ray ray_;
    std::array<vec3, 3> corners_;
    std::array<dvec3, 3> relative_;
    /// u, v, w, their sum, and a . (b x c); and the bounds of their errors.
    std::array<double, 5> value_{};
    std::array<double, 5> error_{};
    mutable std::shared_ptr<const Integers> integers_;
};

/// The exact answer: the smallest t, and of triangles with exactly the same t the smallest prim_id.
struct Truth {
    std::uint32_t prim_id = kNoPrim;
    double t = 0;

    bool hit() const { return prim_id != kNoPrim; }
    bool operator==(const Truth&) const = default;
};

/// The distance of |t|, as a float, to the next larger float.
double ulp_of(double t);

/// Triangles projected along a ray, in double: one projection a vertex keeps meshes closed.
class ParallelView {
public:
    explicit ParallelView(const Ray& ray);

    /// Adds a triangle. Triangles without an extent across the ray have no effect.
    void add(std::uint32_t prim_id, vec3 a, vec3 b, vec3 c);

    /// Whether, in a spot at most `radius` away from the ray, no triangle is more than `ulps` of t
    /// in front of prim_id, or there is none for kNoPrim. Hits count at t > 0 in [tnear, tfar].
    /// Ignores spots narrower than about 2^-16 of the radius.
    bool shows(std::uint32_t prim_id, double radius, double ulps) const;

    /// Whether an edge is at most `radius` away from the ray at a t in range that is no more than
    /// `ulps` larger than most_t: the test for triangles without an extent across the ray.
    bool grazes(vec3 a, vec3 b, vec3 c, double radius, double most_t, double ulps) const;

private:
    struct Seen {
        std::uint32_t prim_id;
        /// x, y across the ray; z along it in units of t.
        std::array<dvec3, 3> corner;
    };

    dvec3 seen(vec3 p) const;

    Ray ray_;
    dvec3 x_, y_, along_;
    std::vector<Seen> triangles_;
};

enum class Verdict {
    kRight,          // the exact candidate, one with exactly its t, or a miss
    kClose,          // another triangle that is hit, t at most 4 ulp apart
    kDisplaced,      // the answer of a line within the displacement of the ray
    kBeside,         // a triangle that is missed near an edge, t at most 4 ulp apart
    kWrongTriangle,  // any other triangle although one is hit
    kFalseMiss,      // a miss although a triangle is hit
    kFalseHit,       // a triangle although none is hit
    kLeak,           // a miss or a farther triangle, and the ray passes near an edge
};
inline constexpr std::size_t kVerdictCount = 8;

/// Whether the verdict counts as wrong: all but the first four.
bool is_wrong(Verdict verdict);

/// Computes exact answers and judges those of methods. Thread-safe.
class ExactReferee {
public:
    /// The arguments outlive the referee. Positions are the tracer's, in any space, and the tree is
    /// around them. Triangles with a vertex that is not finite (or kInvalidCoordinate on all axes)
    /// are never hit.
    ExactReferee(const Topology& topology, std::span<const vec3> positions, const PeerTree& tree);

    Truth closest(const Ray& ray) const;
    Truth closest_of(const Ray& ray, std::span<const std::uint32_t> candidates) const;

    /// `truth` is closest(ray); `prim_id` is the answer of a tracer, kNoPrim for a miss.
    Verdict judge(const Ray& ray, const Truth& truth, std::uint32_t prim_id) const;
    /// Likewise for the answer whether anything is hit.
    Verdict judge_occlusion(const Ray& ray, const Truth& truth, bool occluded) const;
    /// How far t, u and v of a hit are off: t in ulp, u and v in ulp of 1. The line crosses the
    /// plane of the hit's triangle.
    std::array<double, 3> errors(const Ray& ray, const Hit& hit) const;

private:
    std::array<vec3, 3> corners(std::uint32_t prim_id) const;
    ExactTriangle triangle(const Ray& ray, std::uint32_t prim_id) const;
    /// Finds the triangles whose leaves come within `margin` of the ray's line at t >= 0. Boxes are
    /// in double, enlarged by far more than rounding errors.
    std::vector<std::uint32_t> find_candidates(const Ray& ray, double margin) const;
    /// Whether a parallel line as near as the rule displaces vertices answers so within 4 ulp of t.
    bool seen_nearby(const Ray& ray, const Truth& truth, std::uint32_t prim_id) const;

    const Topology* topology_;
    std::span<const vec3> positions_;
    const PeerTree* tree_;
    /// Coordinate; boxes are enlarged for rounding by a part of it.
    double largest_ = 0;
    /// 0 for triangles that are never hit because of a corner, or two corners in one point.
    std::vector<std::uint8_t> usable_;
};

}  // namespace mray::lab
