// Decides exactly what a ray hits, and classifies answers. Shares no code with the tracers;
// docs/guide/crosscheck.md has the definitions.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "lab/accuracy/referee/exact_triangle.h"

namespace mray::accuracy {

/// Tests the boxes of a tree in double, enlarged by far more than the rounding errors. Shares no
/// code with the tracers. Takes trees in any space.
class CandidateSearch {
public:
    /// The tree outlives the search; its boxes contain their triangles.
    explicit CandidateSearch(const Bvh& bvh);

    /// Triangles of the leaves whose boxes come within `margin` of the ray's line at t >= 0, in any
    /// order. Replaces the content of `found`. Thread-safe.
    void find(const Ray& ray, double margin, std::vector<std::uint32_t>& found) const;

private:
    const Bvh* bvh_;
    /// By how much boxes are enlarged for rounding, from the largest coordinate.
    double rounding_;
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

/// "right", "close", "displaced", "beside", "wrong triangle", "false miss", "false hit", "leak".
const char* name_of(Verdict verdict);
/// Whether the verdict counts as wrong: all but the first four.
bool is_wrong(Verdict verdict);

struct Judgement {
    Verdict verdict = Verdict::kRight;
    /// By how many ulps (of a float at the larger t) the t of the answered triangle's plane exceeds
    /// the exact one; 0 unless both hit.
    double t_ulps = 0;
    /// As ExactTriangle::edge_distance, of the exact candidate if there is one, otherwise of the
    /// answered triangle; 0 for a right answer.
    double edge_distance = 0;
};

/// Computes exact answers and judges those of methods. Thread-safe.
class ExactReferee {
public:
    /// The arguments outlive the referee. Positions are those of the tracer, in any space; the
    /// tree's boxes contain their triangles. Triangles with a vertex that is not finite (or
    /// kInvalidCoordinate on all axes) are never hit.
    ExactReferee(const Topology& topology, std::span<const vec3> positions, const Bvh& bvh);

    Truth closest(const Ray& ray) const;
    /// As closest(), by testing all triangles without the tree.
    Truth closest_of_all(const Ray& ray) const;

    /// `truth` is closest(ray); `prim_id` is the answer of a tracer, kNoPrim for a miss.
    Judgement judge(const Ray& ray, const Truth& truth, std::uint32_t prim_id) const;

private:
    /// The triangle as the ray meets it.
    ExactTriangle triangle(const Ray& ray, std::uint32_t prim_id) const;
    Truth closest_of(const Ray& ray, std::span<const std::uint32_t> candidates) const;
    /// Whether a line parallel to the ray, not farther away than the rule displaces vertices, has
    /// the answer prim_id (kNoPrim: a miss) as the nearest, up to 4 ulp of t.
    bool seen_nearby(const Ray& ray, const Truth& truth, std::uint32_t prim_id) const;

    const Topology* topology_;
    std::span<const vec3> positions_;
    CandidateSearch search_;
    /// 0 for triangles that are never hit because of a corner, or two corners in one point.
    std::vector<std::uint8_t> usable_;
};

}  // namespace mray::accuracy
