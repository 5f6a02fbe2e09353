#include "common/bvh/builder/area_split.h"

#include <algorithm>
#include <bit>

namespace mray {
namespace {

// One an octave: the largest boxes are in the first, all below 2^-15 of their area in the last.
constexpr std::uint32_t kAreaBins = 16;

/// Ascends with the area.
std::uint32_t key_of(float area) { return std::bit_cast<std::uint32_t>(area) >> 23; }

/// Some refs of a set.
struct Part {
    Box box;
    std::size_t refs = 0;
    std::size_t triangles = 0;

    void add(const Part& other) {
        box.extend(other.box);
        refs += other.refs;
        triangles += other.triangles;
    }
    float cost() const {
        return PrimRef(box, 0).area() * (static_cast<float>(triangles) + kPartCost);
    }
};

// Where no box has more than this part of the mean area of the two parts, a plane divides well.
constexpr float kLargeArea = 0.25f;

}  // namespace

float largest_area(std::span<const PrimRef> refs) {
    float largest = 0;
    for (const PrimRef& ref : refs) largest = std::max(largest, ref.area());
    return largest;
}

PartSize split_by_area(std::span<const PrimRef> refs, PrimRef* out, std::size_t triangles,
                       const PartSize& other, float& largest) {
    const float least = kLargeArea * other.cost / (static_cast<float>(triangles) + 2 * kPartCost);
    if (largest < least) return {};
    largest = largest_area(refs);
    if (largest < least) return {};

    Part bins[kAreaBins];
    const auto bin_of = [most = key_of(largest)](const PrimRef& ref) {
        return std::min(most - key_of(ref.area()), kAreaBins - 1);
    };
    for (const PrimRef& ref : refs) bins[bin_of(ref)].add({ref.box(), 1, ref.triangle_count()});
    float right_cost[kAreaBins];
    Part right;
    for (std::uint32_t i = kAreaBins; --i > 0;) {
        right.add(bins[i]);
        right_cost[i] = right.cost();
    }
    PartSize best;
    std::uint32_t place = 0;
    Part left;
    for (std::uint32_t i = 1; i < kAreaBins; ++i) {
        left.add(bins[i - 1]);
        const float cost = left.cost() + right_cost[i];
        if (left.refs == refs.size() || cost >= std::min(best.cost, other.cost)) continue;
        best = {left.refs, left.triangles, cost};
        place = i;
    }
    PrimRef* large = out;
    PrimRef* small = out + best.triangles;
    if (place > 0) {
        for (const PrimRef& ref : refs) *(bin_of(ref) < place ? large : small)++ = ref;
    }
    return best;
}

}  // namespace mray
