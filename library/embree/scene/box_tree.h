// A tree over the boxes of primitives, for point queries: these ask for all primitives near a
// point, in the caller's function, which the library has no question for.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "library/embree/scene/bounds.h"

namespace mray::embree {

struct PrimBox : Bounds {
    /// The mesh in Committed::parts, and its primitive.
    std::uint32_t part;
    std::uint32_t prim_id;
};

/// A binary tree over the median of the longest axis, in the order of its boxes. The node over the
/// boxes [first, last) has the halves of them as children; its number is that of its middle box.
class BoxTree {
public:
    explicit BoxTree(std::vector<PrimBox> boxes);

    /// Calls visit(box) for boxes at most `radius` away from the point, the nearer half of each
    /// node first. `radius` is read again after each call, which may lower it.
    template <class Visit>
    void visit_near(const std::array<float, 3>& point, const float& radius, Visit visit) const {
        if (!boxes_.empty()) visit_range(0, boxes_.size(), point, radius, visit);
    }

private:
    static constexpr std::size_t kLeaf = 4;

    void build(std::size_t first, std::size_t last);
    const Bounds& bounds_of(std::size_t first, std::size_t last) const {
        return bounds_[first + (last - first) / 2];
    }

    template <class Visit>
    void visit_range(std::size_t first, std::size_t last, const std::array<float, 3>& point,
                     const float& radius, Visit& visit) const {
        const auto is_near = [&](float distance2) { return distance2 <= radius * radius; };
        if (last - first <= kLeaf) {
            for (std::size_t i = first; i < last; ++i)
                if (is_near(boxes_[i].distance2(point))) visit(boxes_[i]);
            return;
        }
        const std::size_t middle = first + (last - first) / 2;
        const float left = distance2(first, middle, point);
        const float right = distance2(middle, last, point);
        if (left <= right) {
            if (is_near(left)) visit_range(first, middle, point, radius, visit);
            if (is_near(right)) visit_range(middle, last, point, radius, visit);
        } else {
            if (is_near(right)) visit_range(middle, last, point, radius, visit);
            if (is_near(left)) visit_range(first, middle, point, radius, visit);
        }
    }
    float distance2(std::size_t first, std::size_t last, const std::array<float, 3>& point) const {
        return last - first <= kLeaf ? 0 : bounds_of(first, last).distance2(point);
    }

    std::vector<PrimBox> boxes_;
    /// By node.
    std::vector<Bounds> bounds_;
};

}  // namespace mray::embree
