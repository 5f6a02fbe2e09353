#include "cpu/refit.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "common/bvh_refit.h"

namespace morphray::cpu {
namespace {

// Elements a task: large enough to hide the scheduling, small enough to balance.
constexpr std::uint32_t kLeafGrain = 512;
constexpr std::uint32_t kNodeGrain = 128;

template <class Step>
void for_each_index(std::uint32_t begin, std::uint32_t end, std::uint32_t grain, Step step) {
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(begin, end, grain),
                      [&](const tbb::blocked_range<std::uint32_t>& range) {
                          for (std::uint32_t i = range.begin(); i != range.end(); ++i) step(i);
                      });
}

}  // namespace

void refit(Bvh& bvh, std::span<const vec3> positions) {
    for_each_index(0, static_cast<std::uint32_t>(bvh.leaves.size()), kLeafGrain,
                   [&](std::uint32_t leaf) { refit_leaf(bvh, leaf, positions); });
    for (std::uint32_t level = bvh.depth(); level-- > 1;) {
        for_each_index(bvh.level_begin[level], bvh.level_begin[level + 1], kNodeGrain,
                       [&](std::uint32_t node) { refit_node(bvh, node); });
    }
}

}  // namespace morphray::cpu
