// Judges the rays of a driver: against the exact rule, and where they differ from it, against the
// referee in exact arithmetic.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "accuracy/referee/exact_referee.h"
#include "common/backend.h"
#include "common/driver_rays.h"
#include "common/scene_queries.h"

namespace mray::accuracy {

/// How an answer is wrong, the first that applies.
enum class Fault : std::uint8_t {
    kBadAnswer,         // a triangle that does not exist, or t, u or v that are no numbers
    kHole,              // no hit, although the ray and all lines near it hit triangles
    kLost,              // no hit, although the ray hits a triangle
    kPassed,            // a triangle behind the one that is hit, near an edge of that one
    kInvented,          // a hit, although the ray hits nothing
    kWrongTriangle,     // any other triangle
    kAnyHit,            // "occluded" is not what the closest hit says
    kLostCrossing,      // of all hits one is missing
    kDoubleCrossing,    // an edge or vertex of a closed mesh counts more than once
    kInventedCrossing,  // a triangle is among all hits that the ray misses by far
    kRepeated,          // a triangle is twice among all hits
};
inline constexpr std::size_t kFaultCount = 11;

/// "bad answer", "hole", "lost", "passed", ...
const char* name_of(Fault fault);
/// The comment above, as a phrase for reports.
const char* meaning_of(Fault fault);

/// How far t, u and v of hits are from the exact ones of the triangle that was answered.
struct HitErrors {
    /// Hits whose t is off by up to these numbers of ulp of a float at the larger t, and by more.
    static constexpr std::array<double, 5> kUlps = {0.5, 1, 4, 16, 256};
    std::array<std::uint64_t, kUlps.size() + 1> t_counts{};
    double worst_t_ulps = 0;
    std::size_t worst_t_ray = 0;
    /// The largest error of u or v, which are weights in [0, 1].
    double worst_weight = 0;
    std::size_t worst_weight_ray = 0;

    void add(const HitErrors& other);
};

struct SuspectCounts {
    std::uint64_t rays = 0;
    /// Rays whose closest hit has another prim_id than the rule gives, and is not wrong all the
    /// same.
    std::uint64_t other_triangle = 0;
    /// Rays whose crossings are shared out otherwise at edges, and are not wrong all the same.
    std::uint64_t other_crossings = 0;
    /// Rays with too many hits to list.
    std::uint64_t unlisted = 0;
    std::array<std::uint64_t, kFaultCount> faults{};
    HitErrors driver;
    HitErrors ours;

    std::uint64_t operator[](Fault fault) const { return faults[static_cast<std::size_t>(fault)]; }
    std::uint64_t wrong() const;
};

/// The first of a kind on a set of rays.
struct Finding {
    Fault fault = Fault::kLost;
    std::size_t ray = 0;
    /// Closest hits of the driver and of the rule.
    Hit answered = no_hit();
    Hit ruled = no_hit();
    Truth truth;
    /// Triangles that the driver and the rule list, for faults of all hits.
    std::vector<std::uint32_t> answered_prims;
    std::vector<std::uint32_t> ruled_prims;
};

/// One pose of a mesh in scene space, with a tree over it. All outlive their use.
struct PosedMesh {
    const Topology& topology;
    std::span<const vec3> positions;
    const Bvh& bvh;
    /// Whether is_closed().
    bool closed = false;
};

/// How far beside the ray a driver may trace that computes with floats relative to the ray's
/// origin: 2^-20 of the distance to the far side of the scene, 16 roundings.
double precision_of(const Ray& ray);

/// Whether each directed edge of the mesh occurs as often as its opposite, and all positions are
/// finite: then a ray that ends far away crosses an even number of triangles if it starts outside.
bool is_closed(const Topology& topology, std::span<const vec3> positions);

struct Judged {
    SuspectCounts counts;
    std::vector<Finding> findings;
    /// The driver's closest hits.
    std::vector<Hit> hits;
    /// For each ray 0, or 1 + the number of its first fault.
    std::vector<std::uint8_t> fault_of_ray;
};

/// Both hold the mesh at this pose: `suspect` with a structure of its own, `ours` with mesh.bvh,
/// and it follows the rule. Takes up to `most_findings` findings of a kind. Throws what they throw.
Judged judge_suspect(DriverRays& suspect, Backend& ours, const PosedMesh& mesh,
                     std::span<const Ray> rays, std::size_t most_findings = 3);

/// Hits of a ray that are listed; rays with more count as SuspectCounts::unlisted.
inline constexpr std::uint32_t kMostListed = 64;

}  // namespace mray::accuracy
