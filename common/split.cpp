#include "common/split.h"

#include <algorithm>
#include <array>
#include <limits>

namespace morphray {
namespace {

constexpr std::size_t kBins = 32;

Box centroid_bounds(std::span<const PrimRef> refs) {
    Box bounds;
    for (const PrimRef& ref : refs) {
        if (!ref.box().empty())
            bounds.extend(vec3(ref.centroid2(0), ref.centroid2(1), ref.centroid2(2)));
    }
    return bounds;
}

/// An order on triangles without ties.
struct ByCentroid {
    int axis;
    bool operator()(const PrimRef& a, const PrimRef& b) const {
        const float ca = a.centroid2(axis);
        const float cb = b.centroid2(axis);
        return ca < cb || (ca == cb && a.prim_id < b.prim_id);
    }
};

struct Split {
    double cost = std::numeric_limits<double>::infinity();
    int axis = 0;
    std::size_t position = 0;
};

struct Bin {
    Box box;
    std::size_t count = 0;
};

/// Maps twice a centroid to its bin along one axis.
class Binning {
public:
    Binning(const Box& bounds, int axis)
        : axis_(axis),
          lower_(bounds.lower[axis]),
          // A hair less than kBins, so that the largest centroid falls into the last bin.
          scale_(static_cast<float>(kBins) * 0.9999f / (bounds.upper[axis] - bounds.lower[axis])) {}

    std::size_t operator()(const PrimRef& ref) const {
        // An empty box (no finite vertex) has centroid 0, which may lie outside the bounds.
        const float bin = (ref.centroid2(axis_) - lower_) * scale_;
        return static_cast<std::size_t>(std::clamp(bin, 0.0f, static_cast<float>(kBins - 1)));
    }

private:
    int axis_;
    float lower_;
    float scale_;
};

/// Sum of area times count on both sides of every boundary; the first of the cheapest.
void best_boundary(const std::array<Bin, kBins>& bins, int axis, Split& best) {
    std::array<double, kBins> right_cost{};
    Box box;
    std::size_t count = 0;
    for (std::size_t i = kBins; --i > 0;) {
        box.extend(bins[i].box);
        count += bins[i].count;
        right_cost[i] = half_area(box) * static_cast<double>(count);
    }
    const std::size_t total = count + bins[0].count;
    box = Box();
    count = 0;
    for (std::size_t i = 1; i < kBins; ++i) {
        box.extend(bins[i - 1].box);
        count += bins[i - 1].count;
        if (count == 0 || count == total) continue;
        const double cost = half_area(box) * static_cast<double>(count) + right_cost[i];
        if (cost < best.cost) best = {cost, axis, i};
    }
}

void sweep_axis(std::span<PrimRef> refs, int axis, std::vector<double>& right_cost, Split& best) {
    std::sort(refs.begin(), refs.end(), ByCentroid{axis});
    Box box;
    for (std::size_t i = refs.size(); --i > 0;) {
        box.extend(refs[i].box());
        right_cost[i] = half_area(box) * static_cast<double>(refs.size() - i);
    }
    box = Box();
    for (std::size_t i = 1; i < refs.size(); ++i) {
        box.extend(refs[i - 1].box());
        const double cost = half_area(box) * static_cast<double>(i) + right_cost[i];
        if (cost < best.cost) best = {cost, axis, i};
    }
}

}  // namespace

std::size_t split_binned(std::span<PrimRef> refs) {
    const Box bounds = centroid_bounds(refs);
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
        if (!(bounds.upper[axis] > bounds.lower[axis])) continue;
        const Binning binning(bounds, axis);
        std::array<Bin, kBins> bins;
        for (const PrimRef& ref : refs) {
            Bin& bin = bins[binning(ref)];
            bin.box.extend(ref.box());
            ++bin.count;
        }
        best_boundary(bins, axis, best);
    }
    if (best.position == 0) return 0;
    const Binning binning(bounds, best.axis);
    const auto middle = std::partition(
        refs.begin(), refs.end(), [&](const PrimRef& ref) { return binning(ref) < best.position; });
    return static_cast<std::size_t>(middle - refs.begin());
}

std::size_t split_sweep(std::span<PrimRef> refs) {
    const Box bounds = centroid_bounds(refs);
    std::vector<double> right_cost(refs.size());
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
        if (bounds.upper[axis] > bounds.lower[axis]) sweep_axis(refs, axis, right_cost, best);
    }
    if (best.position == 0) return 0;
    std::nth_element(refs.begin(), refs.begin() + static_cast<std::ptrdiff_t>(best.position),
                     refs.end(), ByCentroid{best.axis});
    return best.position;
}

std::size_t split_median(std::span<PrimRef> refs) {
    const Box bounds = centroid_bounds(refs);
    int widest = 0;
    for (int axis = 1; axis < 3; ++axis) {
        if (bounds.upper[axis] - bounds.lower[axis] > bounds.upper[widest] - bounds.lower[widest])
            widest = axis;
    }
    const std::size_t half = refs.size() / 2;
    std::nth_element(refs.begin(), refs.begin() + static_cast<std::ptrdiff_t>(half), refs.end(),
                     ByCentroid{widest});
    return half;
}

}  // namespace morphray
