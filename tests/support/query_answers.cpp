#include "tests/support/query_answers.h"

#include <algorithm>

#include "tests/support/same_bits.h"

namespace mray::test {
namespace {

/// The triangles whose crossings are uncertain for a point.
std::vector<std::uint32_t> uncertain_of(const Answers& answers, std::size_t point) {
    std::vector<std::uint32_t> triangles;
    for (const UncertainCrossing& one : answers.uncertain)
        if (one.point == point) triangles.push_back(one.prim_id);
    return triangles;
}

}  // namespace

Questions mixed_questions(const TestScene& scene, const Queries& reference, Crossing crossing,
                          std::size_t count, std::uint64_t seed) {
    Questions q;
    q.rays = mixed_rays(scene, count, seed);
    q.points = mixed_points(scene, count, seed + 1);
    q.after.resize(q.rays.size());
    std::vector<Hit> hits(q.rays.size());
    for (std::size_t step = 0; step < 3; ++step) {
        reference(NextQuery{q.rays, q.after, crossing, hits});
        for (std::size_t i = step; i < q.rays.size(); i += 3)
            if (hits[i].prim_id != kNoPrim) q.after[i] = {hits[i].t, hits[i].prim_id};
    }
    return q;
}

Answers answers_of(const Queries& queries, const Questions& questions, Crossing crossing,
                   std::uint32_t most) {
    Answers a;
    a.counts.resize(questions.rays.size());
    const TriangleFilter* const filter = questions.filter_or_null();
    queries(CountQuery{questions.rays, crossing, a.counts, {}, filter});
    queries(ListQuery{questions.rays, crossing, most, a.lists, {}, filter});
    a.next.resize(questions.rays.size());
    queries(NextQuery{questions.rays, questions.after, crossing, a.next, {}, filter});
    a.windings.resize(questions.points.size());
    queries(WindingQuery{questions.points, a.windings, a.uncertain, {}, filter});
    std::sort(a.uncertain.begin(), a.uncertain.end());
    a.closest.resize(questions.points.size());
    queries(ClosestQuery{questions.points, kAnyDistance2, a.closest, {}, filter});
    a.near.resize(questions.points.size());
    queries(ClosestQuery{questions.points, questions.reach, a.near, {}, filter});
    if (filter == nullptr) return a;
    const std::vector<dvec3> exact(questions.points.begin(), questions.points.end());
    a.exact.resize(questions.points.size());
    queries(ExactClosestQuery{questions.points, exact, kAnyDistance2, a.exact, {}, filter});
    return a;
}

std::vector<std::span<const Hit>> lists_of_rays(const HitLists& lists) {
    std::vector<std::span<const Hit>> of_rays;
    std::size_t first = 0;
    for (const std::uint32_t listed : lists.listed) {
        of_rays.push_back(std::span(lists.hits).subspan(first, listed));
        first += listed;
    }
    return of_rays;
}

void visit_differences(const Answers& a, const Answers& b,
                       const std::function<void(Answered, std::size_t)>& visit) {
    const auto a_lists = lists_of_rays(a.lists);
    const auto b_lists = lists_of_rays(b.lists);
    for (std::size_t i = 0; i < a.counts.size(); ++i) {
        if (a.counts[i] != b.counts[i]) visit(Answered::kCounts, i);
        if (a.lists.total[i] != b.lists.total[i] || !same_bytes(a_lists[i], b_lists[i]))
            visit(Answered::kLists, i);
        if (!same_bits(a.next[i], b.next[i])) visit(Answered::kNextHits, i);
    }
    const bool is_uncertain_same = a.uncertain == b.uncertain;
    for (std::size_t i = 0; i < a.windings.size(); ++i) {
        if (a.windings[i] != b.windings[i] ||
            (!is_uncertain_same && uncertain_of(a, i) != uncertain_of(b, i)))
            visit(Answered::kWindings, i);
        if (!same_bits(a.closest[i], b.closest[i]) || !same_bits(a.near[i], b.near[i]))
            visit(Answered::kClosestPoints, i);
    }
    for (std::size_t i = 0; i < a.exact.size(); ++i)
        if (a.exact[i].prim_id != b.exact[i].prim_id) visit(Answered::kClosestPoints, i);
}

std::size_t count_differences(const Answers& a, const Answers& b) {
    std::size_t different = 0;
    visit_differences(a, b, [&](Answered, std::size_t) { ++different; });
    return different;
}

}  // namespace mray::test
