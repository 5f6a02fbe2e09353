#include "lab/bench/compare_answers.h"

#include <cmath>

namespace mray::bench {

Mismatches compare_hits(const TraceWork& work, std::span<const Hit> a, std::span<const Hit> b) {
    Mismatches mismatches;
    for (std::size_t i = 0; i < work.rays.size(); ++i) {
        if (work.active[i] == 0) continue;
        if ((a[i].prim_id == kNoPrim) != (b[i].prim_id == kNoPrim)) {
            ++mismatches.hit;
        } else if (a[i].prim_id != b[i].prim_id) {
            ++mismatches.prim_id;
        } else if (a[i].prim_id != kNoPrim &&
                   !(std::fabs(a[i].t - b[i].t) <= kMaxRelativeT * a[i].t)) {
            ++mismatches.t;
        }
    }
    return mismatches;
}

Mismatches compare_answers(const TraceWork& work, const TraceAnswers& a, const TraceAnswers& b) {
    if (!work.any_hit()) return compare_hits(work, a.hits, b.hits);
    Mismatches mismatches;
    for (std::size_t i = 0; i < work.rays.size(); ++i) {
        mismatches.hit += work.active[i] != 0 && a.occluded[i] != b.occluded[i];
    }
    return mismatches;
}

}  // namespace mray::bench
