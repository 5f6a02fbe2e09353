#include "common/bvh/split.h"

#include <algorithm>
#include <vector>

#include "common/bvh/split_parts.h"

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
