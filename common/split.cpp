#include "common/split.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "common/split_parts.h"

namespace morphray {
namespace {

/// An order on triangles without ties.
struct ByCentroid {
    int axis;
    bool operator()(const PrimRef& a, const PrimRef& b) const {
        const float ca = a.centroid2(axis);
        const float cb = b.centroid2(axis);
        return ca < cb || (ca == cb && a.prim_id() < b.prim_id());
    }
};

/// Divides by the order along an axis, `position` refs to the left.
std::size_t divide_by_order(std::span<const PrimRef> refs, int axis, std::size_t position,
                            PrimRef* out) {
    std::vector<PrimRef> order(refs.begin(), refs.end());
    const auto pivot = order.begin() + static_cast<std::ptrdiff_t>(position);
    std::nth_element(order.begin(), pivot, order.end(), ByCentroid{axis});
    partition(refs, out, 0, position, [&, first_right = *pivot](const PrimRef& ref) {
        return ByCentroid{axis}(ref, first_right);
    });
    return position;
}

// ---- all positions

void sweep_axis(std::span<PrimRef> refs, int axis, std::vector<float>& right_cost, Split& best) {
    std::sort(refs.begin(), refs.end(), ByCentroid{axis});
    Box4 box = Box4::none();
    for (std::size_t i = refs.size(); --i > 0;) {
        box.extend(refs[i].box());
        right_cost[i] = part_cost(box, refs.size() - i);
    }
    box = Box4::none();
    for (std::size_t i = 1; i < refs.size(); ++i) {
        box.extend(refs[i - 1].box());
        best.consider({part_cost(box, i) + right_cost[i], axis, i, i});
    }
}

/// rank[i]: how many of c[0 .. size) come before c[i], equal ones by their index. Both arrays have
/// room for a multiple of four; c[size ..) is +infinity.
void rank_all(const float* c, std::size_t size, std::int32_t* rank) {
    for (std::size_t block = 0; block < size; block += 4) {
        const float4 own = load4(c + block);
        const std::int32_t first = static_cast<std::int32_t>(block);
        const int4 index = {first, first + 1, first + 2, first + 3};
        int4 sum = {};
        // A comparison that holds is -1.
        for (std::size_t j = 0; j < block; ++j) sum -= splat(c[j]) <= own;
        for (std::int32_t j = first; j < first + 4; ++j) {
            const float4 other = splat(c[j]);
            sum -= (other < own) | ((other == own) & (j < index));
        }
        for (std::size_t j = block + 4; j < size; ++j) sum -= splat(c[j]) < own;
        __builtin_memcpy(rank + block, &sum, sizeof sum);
    }
}

}  // namespace

std::size_t split_sweep(std::span<const PrimRef> refs, PrimRef* out) {
    if (refs.size() <= kFewRefs) return split_few(refs, out);
    const Box4 bounds = centroid_bounds(refs);
    std::vector<PrimRef> order(refs.begin(), refs.end());
    std::vector<float> right_cost(refs.size());
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
        if (bounds.upper[axis] > bounds.lower[axis]) sweep_axis(order, axis, right_cost, best);
    }
    return best.position == 0 ? 0 : divide_by_order(refs, best.axis, best.position, out);
}

std::size_t split_few(std::span<const PrimRef> refs, PrimRef* out) {
    const std::size_t size = refs.size();
    alignas(16) float centroids[3][kFewRefs];
    for (std::size_t i = 0; i < size; ++i) {
        const float4 c = refs[i].centroid2();
        for (int axis = 0; axis < 3; ++axis) centroids[axis][i] = c[axis];
    }
    const Box4 bounds = centroid_bounds(refs);
    std::int32_t ranks[3][kFewRefs];
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
        if (!(bounds.upper[axis] > bounds.lower[axis])) continue;
        std::fill(centroids[axis] + size, centroids[axis] + (size + 3) / 4 * 4,
                  std::numeric_limits<float>::infinity());
        rank_all(centroids[axis], size, ranks[axis]);
        std::uint8_t order[kFewRefs];
        for (std::size_t i = 0; i < size; ++i) order[ranks[axis][i]] = static_cast<std::uint8_t>(i);
        float right_cost[kFewRefs];
        Box4 box = Box4::none();
        for (std::size_t i = size; --i > 0;) {
            box.extend(refs[order[i]].box());
            right_cost[i] = part_cost(box, size - i);
        }
        box = Box4::none();
        for (std::size_t i = 1; i < size; ++i) {
            box.extend(refs[order[i - 1]].box());
            best.consider({part_cost(box, i) + right_cost[i], axis, i, i});
        }
    }
    if (best.position == 0) return 0;
    const std::int32_t* rank = ranks[best.axis];
    partition(refs, out, 0, best.position, [&](const PrimRef& ref) {
        return rank[&ref - refs.data()] < static_cast<std::int32_t>(best.position);
    });
    return best.position;
}

std::size_t split_median(std::span<const PrimRef> refs, PrimRef* out) {
    const Box4 bounds = centroid_bounds(refs);
    const float4 extent = bounds.upper - bounds.lower;
    int widest = 0;
    for (int axis = 1; axis < 3; ++axis) {
        if (extent[axis] > extent[widest]) widest = axis;
    }
    return divide_by_order(refs, widest, refs.size() / 2, out);
}

}  // namespace morphray
