#include "accuracy/suspect/suspect.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

namespace mray::accuracy {
namespace {

constexpr std::size_t kBatch = 4096;
// In sizes of a triangle: within this distance of an edge, crossings may be shared out otherwise.
constexpr double kNearEdge = 0x1p-12;

struct Names {
    const char* name;
    const char* meaning;
};
constexpr Names kNames[kFaultCount] = {
    {"bad answer", "a triangle that does not exist, or t, u or v that are no numbers"},
    {"hole", "no hit, although the ray and all lines near it hit triangles"},
    {"lost", "no hit, although the ray hits a triangle"},
    {"passed", "a triangle behind the one that is hit, near an edge of that one"},
    {"invented", "a hit, although the ray hits nothing"},
    {"wrong triangle", "another triangle in place of the one that is hit"},
    {"any hit", "whether anything is hit is not what the closest hit says"},
    {"lost crossing", "one of all hits is missing"},
    {"double crossing", "an edge or vertex of a closed mesh counts more than once"},
    {"invented crossing", "a triangle that the ray misses is among all hits"},
    {"repeated", "a triangle is twice among all hits, though the geometry forbids it"},
};

bool is_bad(const Hit& hit, std::size_t triangles) {
    if (hit.prim_id == kNoPrim) return false;
    return hit.prim_id >= triangles || !std::isfinite(hit.t) || !std::isfinite(hit.u) ||
           !std::isfinite(hit.v);
}

void add_error(const ExactTriangle& exact, const Hit& hit, std::size_t ray, HitErrors& errors) {
    if (!exact.has_t()) return;
    const double t = exact.t();
    const double ulps =
        std::abs(hit.t - t) / ulp_of(std::max(std::abs(t), std::abs(double{hit.t})));
    std::size_t bucket = 0;
    while (bucket < HitErrors::kUlps.size() && ulps > HitErrors::kUlps[bucket]) ++bucket;
    ++errors.t_counts[bucket];
    if (ulps > errors.worst_t_ulps) {
        errors.worst_t_ulps = ulps;
        errors.worst_t_ray = ray;
    }
    const std::array<double, 2> weights = exact.weights();
    const double weight = std::max(std::abs(hit.u - weights[0]), std::abs(hit.v - weights[1]));
    if (weight > errors.worst_weight) {
        errors.worst_weight = weight;
        errors.worst_weight_ray = ray;
    }
}

std::vector<std::uint32_t> prims_of(std::span<const Hit> hits) {
    std::vector<std::uint32_t> prims;
    for (const Hit& hit : hits) prims.push_back(hit.prim_id);
    std::ranges::sort(prims);
    return prims;
}

/// The answers of one tracer about all rays, with where the lists of hits begin.
struct Lists {
    HitLists lists;
    std::vector<std::size_t> begin;

    void index() {
        begin.assign(1, 0);
        for (const std::uint32_t listed : lists.listed) begin.push_back(begin.back() + listed);
    }
    std::span<const Hit> of(std::size_t ray) const {
        return std::span(lists.hits).subspan(begin[ray], lists.listed[ray]);
    }
};

struct Answers {
    std::vector<Hit> hits;
    std::vector<Hit> ruled;
    std::vector<std::uint8_t> occluded;
    Lists listed;
    Lists owned;
};

class SuspectJudge {
public:
    SuspectJudge(const PosedMesh& mesh, std::span<const Ray> rays, Answers answers)
        : mesh_(mesh),
          rays_(rays),
          answers_(std::move(answers)),
          referee_(mesh.topology, mesh.positions, mesh.bvh),
          fault_of_ray_(rays.size()) {}

    Judged judge(std::size_t most_findings) {
        Judged judged;
        judged.counts.rays = rays_.size();
        std::mutex mutex;
        tbb::parallel_for(
            std::size_t{0}, (rays_.size() + kBatch - 1) / kBatch, [&](std::size_t batch) {
                SuspectCounts counts;
                const std::size_t end = std::min(rays_.size(), (batch + 1) * kBatch);
                for (std::size_t i = batch * kBatch; i < end; ++i) {
                    const std::optional<Fault> fault = judge_ray(i, counts);
                    if (!fault) continue;
                    ++counts.faults[static_cast<std::size_t>(*fault)];
                    fault_of_ray_[i] =
                        static_cast<std::uint8_t>(1 + static_cast<std::size_t>(*fault));
                }
                const std::lock_guard lock(mutex);
                add(counts, judged.counts);
            });
        judged.findings = findings(most_findings);
        judged.hits = std::move(answers_.hits);
        judged.fault_of_ray = std::move(fault_of_ray_);
        return judged;
    }

private:
    static void add(const SuspectCounts& from, SuspectCounts& to) {
        to.other_triangle += from.other_triangle;
        to.other_crossings += from.other_crossings;
        to.unlisted += from.unlisted;
        for (std::size_t i = 0; i < kFaultCount; ++i) to.faults[i] += from.faults[i];
        to.driver.add(from.driver);
        to.ours.add(from.ours);
    }

    std::optional<Fault> judge_ray(std::size_t i, SuspectCounts& counts) const {
        const Hit& hit = answers_.hits[i];
        const Hit& ruled = answers_.ruled[i];
        if (is_bad(hit, mesh_.topology.triangles.size())) return Fault::kBadAnswer;
        if (hit.prim_id != ruled.prim_id) {
            const std::optional<Fault> fault = judge_closest(rays_[i], hit);
            if (fault) return fault;
            ++counts.other_triangle;
        }
        if (ruled.prim_id != kNoPrim)
            add_error(referee_.triangle(rays_[i], ruled.prim_id), ruled, i, counts.ours);
        if (hit.prim_id != kNoPrim)
            add_error(referee_.triangle(rays_[i], hit.prim_id), hit, i, counts.driver);
        if ((answers_.occluded[i] != 0) != (hit.prim_id != kNoPrim)) return Fault::kAnyHit;
        return judge_crossings(i, counts);
    }

    std::optional<Fault> judge_closest(const Ray& ray, const Hit& hit) const {
        const Truth truth = referee_.closest(ray);
        const Judgement judgement = referee_.judge(ray, truth, hit.prim_id);
        if (!is_wrong(judgement.verdict)) return std::nullopt;
        if (is_at_end(ray, hit.prim_id) || is_at_end(ray, truth.prim_id)) return std::nullopt;
        if (!truth.hit()) return Fault::kInvented;
        if (hit.prim_id == kNoPrim) {
            const bool is_outline = referee_.is_seen_within(ray, truth, kNoPrim, precision_of(ray));
            return is_outline ? Fault::kLost : Fault::kHole;
        }
        return judgement.verdict == Verdict::kLeak ? Fault::kPassed : Fault::kWrongTriangle;
    }

    /// Whether the ray begins or ends so near the triangle that rounding, or whether an end belongs
    /// to the ray, decides about the hit. Rays start on surfaces often.
    bool is_at_end(const Ray& ray, std::uint32_t prim_id) const {
        if (prim_id == kNoPrim) return false;
        const ExactTriangle triangle = referee_.triangle(ray, prim_id);
        if (!triangle.has_t()) return false;
        const double t = triangle.t();
        return std::min(std::abs(t - ray.tnear), std::abs(t - ray.tfar)) <= precision_of(ray);
    }

    /// Whether the ray passes so near an edge, or so steeply, that whether it crosses the triangle
    /// may depend on rounding, or is at an end.
    bool is_uncertain(const Ray& ray, std::uint32_t prim_id) const {
        const ExactTriangle triangle = referee_.triangle(ray, prim_id);
        return !triangle.has_t() || !(triangle.edge_distance() >= kNearEdge) ||
               is_at_end(ray, prim_id);
    }

    std::optional<Fault> judge_crossings(std::size_t i, SuspectCounts& counts) const {
        if (answers_.listed.lists.total[i] > kMostListed ||
            answers_.owned.lists.total[i] > kMostListed) {
            ++counts.unlisted;
            return std::nullopt;
        }
        const std::vector<std::uint32_t> listed = prims_of(answers_.listed.of(i));
        const std::vector<std::uint32_t> owned = prims_of(answers_.owned.of(i));
        if (listed == owned) return std::nullopt;
        if (!listed.empty() && listed.back() >= mesh_.topology.triangles.size())
            return Fault::kBadAnswer;
        if (std::ranges::adjacent_find(listed) != listed.end()) return Fault::kRepeated;
        const auto only_in = [&](const auto& all, const auto& other) {
            std::vector<std::uint32_t> only;
            std::ranges::set_difference(all, other, std::back_inserter(only));
            std::erase_if(only, [&](std::uint32_t p) { return is_uncertain(rays_[i], p); });
            return !only.empty();
        };
        if (only_in(owned, listed)) return Fault::kLostCrossing;
        if (only_in(listed, owned)) return Fault::kInventedCrossing;
        const auto is_at_end_of_ray = [&](std::uint32_t p) { return is_at_end(rays_[i], p); };
        const bool has_end = std::ranges::any_of(listed, is_at_end_of_ray) ||
                             std::ranges::any_of(owned, is_at_end_of_ray);
        if (mesh_.closed && !has_end && listed.size() % 2 != owned.size() % 2)
            return listed.size() > owned.size() ? Fault::kDoubleCrossing : Fault::kLostCrossing;
        ++counts.other_crossings;
        return std::nullopt;
    }

    std::vector<Finding> findings(std::size_t most) const {
        std::array<std::size_t, kFaultCount> found{};
        std::vector<Finding> findings;
        for (std::size_t i = 0; i < rays_.size(); ++i) {
            if (fault_of_ray_[i] == 0) continue;
            const std::size_t fault = fault_of_ray_[i] - std::size_t{1};
            if (found[fault]++ >= most) continue;
            findings.push_back({static_cast<Fault>(fault), i, answers_.hits[i], answers_.ruled[i],
                                referee_.closest(rays_[i]), prims_of(answers_.listed.of(i)),
                                prims_of(answers_.owned.of(i))});
        }
        std::ranges::stable_sort(findings, {}, &Finding::fault);
        return findings;
    }

    const PosedMesh& mesh_;
    std::span<const Ray> rays_;
    Answers answers_;
    ExactReferee referee_;
    std::vector<std::uint8_t> fault_of_ray_;
};

}  // namespace

double precision_of(const Ray& ray) {
    return 0x1p-20 * (2 * kSceneExtent + largest_magnitude(ray.org));
}

const char* name_of(Fault fault) { return kNames[static_cast<std::size_t>(fault)].name; }
const char* meaning_of(Fault fault) { return kNames[static_cast<std::size_t>(fault)].meaning; }

void HitErrors::add(const HitErrors& other) {
    for (std::size_t i = 0; i < t_counts.size(); ++i) t_counts[i] += other.t_counts[i];
    if (other.worst_t_ulps > worst_t_ulps) {
        worst_t_ulps = other.worst_t_ulps;
        worst_t_ray = other.worst_t_ray;
    }
    if (other.worst_weight > worst_weight) {
        worst_weight = other.worst_weight;
        worst_weight_ray = other.worst_weight_ray;
    }
}

std::uint64_t SuspectCounts::wrong() const {
    std::uint64_t sum = 0;
    for (const std::uint64_t count : faults) sum += count;
    return sum;
}

bool is_closed(const Topology& topology, std::span<const vec3> positions) {
    if (!std::ranges::all_of(positions, [](vec3 p) { return p != vec3(kInvalidCoordinate); }))
        return false;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::int64_t> balance;
    for (const uvec3& t : topology.triangles) {
        for (int corner = 0; corner < 3; ++corner) {
            const std::uint32_t a = t[corner];
            const std::uint32_t b = t[(corner + 1) % 3];
            if (a < b) ++balance[{a, b}];
            if (a > b) --balance[{b, a}];
        }
    }
    return std::ranges::all_of(balance, [](const auto& edge) { return edge.second == 0; });
}

Judged judge_suspect(DriverRays& suspect, Backend& ours, const PosedMesh& mesh,
                     std::span<const Ray> rays, std::size_t most_findings) {
    Answers answers;
    answers.hits.resize(rays.size());
    answers.ruled.resize(rays.size());
    answers.occluded.resize(rays.size());
    suspect.intersect(rays, answers.hits);
    suspect.occluded(rays, answers.occluded);
    suspect.list(rays, kMostListed, answers.listed.lists);
    ours.trace_rays(rays, answers.ruled);
    ours.scene_queries().list(rays, Crossing::kOwner, kMostListed, answers.owned.lists);
    answers.listed.index();
    answers.owned.index();
    return SuspectJudge(mesh, rays, std::move(answers)).judge(most_findings);
}

}  // namespace mray::accuracy
