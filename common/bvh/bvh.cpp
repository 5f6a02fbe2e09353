#include "common/bvh/bvh.h"

#include "common/base/hash.h"

namespace mray {

std::uint64_t bvh_hash(const Bvh& bvh) {
    return Hasher().add(std::span(bvh.nodes)).add(std::span(bvh.leaves)).digest();
}

void add_repeated(Bvh& bvh, std::vector<RepeatedTriangle> more) {
    if (more.empty()) return;
    const auto by_prim = [](const RepeatedTriangle& a, const RepeatedTriangle& b) {
        return a.prim_id < b.prim_id;
    };
    std::sort(more.begin(), more.end(), by_prim);
    // A triangle that stood for others may have another one stand for it now.
    for (RepeatedTriangle& old : bvh.repeated) {
        const auto found =
            std::lower_bound(more.begin(), more.end(), RepeatedTriangle{0, old.first}, by_prim);
        if (found != more.end() && found->prim_id == old.first) old.first = found->first;
    }
    bvh.repeated.insert(bvh.repeated.end(), more.begin(), more.end());
    std::sort(bvh.repeated.begin(), bvh.repeated.end());
}

}  // namespace mray
