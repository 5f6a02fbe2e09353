#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tests/fuzz/judge/judge.h"

namespace mray::fuzz {
namespace {

constexpr std::uint32_t kAllOfThem = std::numeric_limits<std::uint32_t>::max();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// One of the cursors at and next to the hits of a ray.
HitCursor cursor_of(std::span<const Hit> hits, std::size_t kind) {
    if (hits.empty()) return kind % 2 == 0 ? HitCursor{} : HitCursor{1.0f, 0};
    const Hit& hit = hits[kind / 8 % hits.size()];
    switch (kind % 8) {
        case 0:
            return {};
        case 1:
            return {std::nextafter(hit.t, kInfinity), hit.prim_id};
        case 2:
            return {std::nextafter(hit.t, -1.0f), hit.prim_id};
        case 3:
            return {hit.t, hit.prim_id + 1};
        case 4:
            return {hit.t, hit.prim_id == 0 ? 0 : hit.prim_id - 1};
        case 5:
            return {hit.t, kNoPrim};
        default:
            return {hit.t, hit.prim_id};
    }
}

Asked asked_of(test::Answered answered) {
    constexpr std::array kAsked = {Asked::kHitCounts, Asked::kAllHits, Asked::kNextHits,
                                   Asked::kWindings, Asked::kClosestPoints};
    return kAsked[static_cast<std::size_t>(answered)];
}

}  // namespace

const char* name_of(Asked asked) {
    constexpr std::array kNames = {"image",    "closest hits", "any hits", "counts of hits",
                                   "all hits", "next hits",    "windings", "closest points"};
    return kNames[static_cast<std::size_t>(asked)];
}

bool is_about_points(Asked asked) {
    return asked == Asked::kWindings || asked == Asked::kClosestPoints;
}

void AnswerDifferences::add(Asked asked, std::size_t index) {
    for (AnswerDifference& difference : differences_) {
        if (difference.asked != asked) continue;
        ++difference.count;
        return;
    }
    differences_.push_back({asked, 1, index});
}

CaseQueries::CaseQueries(const FuzzScene& scene, const FuzzCase& fuzz_case,
                         const test::Queries& reference) {
    test::Questions questions;
    for (std::size_t i = 0; i < fuzz_case.rays.size(); ++i) {
        const SceneRay ray = to_scene(scene.space, fuzz_case.rays[i]);
        if (!ray.valid) continue;
        questions.rays.push_back(ray.ray);
        ray_indices_.push_back(i);
    }
    for (std::size_t i = 0; i < fuzz_case.points.size(); ++i) {
        const vec3 world = fuzz_case.points[i];
        if (!std::isfinite(world.x) || !std::isfinite(world.y) || !std::isfinite(world.z)) continue;
        const vec3 point = scene.space.to_scene(world);
        if (!(largest_component(point) < kOriginExtent)) continue;
        questions.points.push_back(point);
        point_indices_.push_back(i);
    }
    questions.after.resize(questions.rays.size());
    // A distance of one of the points, and just less.
    float reach = kAnyDistance2;
    if (!questions.points.empty()) {
        ClosestTriangle closest;
        const std::size_t middle = questions.points.size() / 2;
        reference(ClosestQuery{{&questions.points[middle], 1}, kAnyDistance2, {&closest, 1}});
        reach = closest.d2;
    }
    const float less = reach > 0 ? std::nextafter(reach, 0.0f) : 0;
    for (const auto& [crossing, most, round_reach] :
         {std::tuple(Crossing::kEach, kAllOfThem, reach),
          {Crossing::kOwner, kAllOfThem, less},
          {Crossing::kOwner, 2u, 0.0f}}) {
        questions.reach = round_reach;
        HitLists lists;
        reference(ListQuery{questions.rays, crossing, kAllOfThem, lists});
        const auto hits = test::lists_of_rays(lists);
        for (std::size_t i = 0; i < hits.size(); ++i)
            questions.after[i] = cursor_of(hits[i], i + 5 * rounds_.size());
        rounds_.push_back(
            {crossing, most, questions, test::answers_of(reference, questions, crossing, most)});
    }
}

std::vector<AnswerDifference> CaseQueries::compare(const test::Queries& queries) const {
    AnswerDifferences differences;
    for (const Round& round : rounds_) {
        const test::Answers actual =
            test::answers_of(queries, round.questions, round.crossing, round.most);
        test::visit_differences(round.expected, actual, [&](test::Answered kind, std::size_t i) {
            const Asked asked = asked_of(kind);
            differences.add(asked, (is_about_points(asked) ? point_indices_ : ray_indices_)[i]);
        });
    }
    return differences.all();
}

}  // namespace mray::fuzz
