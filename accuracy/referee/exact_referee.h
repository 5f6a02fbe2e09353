// What a ray hits, decided exactly, and what is wrong with an answer. Shares no code with the
// tracers; docs/accuracy.md has the definitions.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "accuracy/measure/candidate_search.h"
#include "accuracy/referee/exact_triangle.h"

namespace morphray::accuracy {

/// The exact answer: the smallest t, and of triangles with exactly the same t the smallest prim_id.
struct Truth {
    std::uint32_t prim_id = kNoPrim;
    double t = 0;

    bool hit() const { return prim_id != kNoPrim; }
    bool operator==(const Truth&) const = default;
};

enum class Verdict {
    kRight,          // the exact candidate, one with exactly its t, or a miss
    kClose,          // another one that is hit too, t at most 4 ulp apart
    kDisplaced,      // what a line within the displacement of the ray sees
    kBeside,         // one that is not hit, but near an edge of it, t at most 4 ulp apart
    kWrongTriangle,  // any other hit where there is one
    kFalseMiss,      // nothing, where something is hit
    kFalseHit,       // something, where nothing is hit
    kLeak,           // nothing or something farther away, and the ray passes near an edge
};
inline constexpr std::size_t kVerdictCount = 8;

/// "right", "close", "displaced", "beside", "wrong triangle", "false miss", "false hit", "leak".
const char* name_of(Verdict verdict);
/// Whether it counts: all but the first four.
bool is_wrong(Verdict verdict);

struct Judgement {
    Verdict verdict = Verdict::kRight;
    /// How many ulps (of a float at the larger t) the t of the answered triangle's plane is larger;
    /// 0 unless both hit.
    double t_ulps = 0;
    /// As ExactTriangle::edge_distance, of the exact candidate if there is one, otherwise of the
    /// answered triangle; 0 for a right answer.
    double edge_distance = 0;
};

/// Threads may share one.
class ExactReferee {
public:
    /// What it is given outlives it. Positions as the tracer has them, in any space; the tree's
    /// boxes contain their triangles. Triangles with a vertex that is not finite (or
    /// kInvalidCoordinate on all axes) are never hit.
    ExactReferee(const Topology& topology, std::span<const vec3> positions, const Bvh& bvh);

    Truth closest(const Ray& ray) const;
    /// Likewise by all triangles, without the tree.
    Truth closest_of_all(const Ray& ray) const;

    /// `truth` is closest(ray); `prim_id` what a tracer answered, kNoPrim for a miss.
    Judgement judge(const Ray& ray, const Truth& truth, std::uint32_t prim_id) const;

private:
    ExactTriangle triangle(const Ray& ray, std::uint32_t prim_id) const;
    Truth closest_of(const Ray& ray, std::span<const std::uint32_t> candidates) const;
    bool seen_nearby(const Ray& ray, const Truth& truth, std::uint32_t prim_id) const;

    const Topology* topology_;
    std::span<const vec3> positions_;
    CandidateSearch search_;
    /// 0 for triangles that are never hit because of a corner, or two corners in one point.
    std::vector<std::uint8_t> usable_;
};

}  // namespace morphray::accuracy
