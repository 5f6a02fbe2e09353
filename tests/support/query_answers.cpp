#include "tests/support/query_answers.h"

#include <algorithm>

#include "tests/support/mixed_points.h"
#include "tests/support/same_bits.h"

namespace mray::test {

Questions mixed_questions(const TestScene& scene, const Queries& reference, Crossing crossing,
                          std::size_t count, std::uint64_t seed) {
    Questions q;
    q.rays = mixed_rays(scene, count, seed);
    q.points = mixed_points(scene.topology().triangles, scene.positions(), count, seed + 1);
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
    queries(CountQuery{questions.rays, crossing, a.counts});
    queries(ListQuery{questions.rays, crossing, most, a.lists});
    a.next.resize(questions.rays.size());
    queries(NextQuery{questions.rays, questions.after, crossing, a.next});
    a.windings.resize(questions.points.size());
    queries(WindingQuery{questions.points, a.windings, a.uncertain});
    std::sort(a.uncertain.begin(), a.uncertain.end());
    a.closest.resize(questions.points.size());
    queries(ClosestQuery{questions.points, kAnyDistance2, a.closest});
    a.near.resize(questions.points.size());
    queries(ClosestQuery{questions.points, questions.reach, a.near});
    return a;
}

std::size_t count_differences(const Answers& a, const Answers& b) {
    std::size_t different = a.lists.hits.size() != b.lists.hits.size();
    different += a.uncertain != b.uncertain;
    for (std::size_t i = 0; i < a.counts.size(); ++i) {
        different += a.counts[i] != b.counts[i];
        different += a.lists.listed[i] != b.lists.listed[i] || a.lists.total[i] != b.lists.total[i];
        different += !same_bits(a.next[i], b.next[i]);
    }
    for (std::size_t i = 0; i < std::min(a.lists.hits.size(), b.lists.hits.size()); ++i)
        different += !same_bits(a.lists.hits[i], b.lists.hits[i]);
    for (std::size_t i = 0; i < a.windings.size(); ++i) {
        different += a.windings[i] != b.windings[i];
        different += a.closest[i] != b.closest[i];
        different += a.near[i] != b.near[i];
    }
    return different;
}

}  // namespace mray::test
