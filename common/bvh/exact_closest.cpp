#include "common/bvh/exact_closest.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "common/bvh/box.h"
#include "common/bvh/triangle_distance.h"
#include "common/interop/hit_rule.h"

namespace mray {
namespace {

/// The closest triangle to a point among some, the lowest prim_id of equally close ones.
class ClosestChoice {
public:
    ClosestChoice(const dvec3& p, vec3 lower, vec3 upper);

    /// A lower bound, by which boxes may be visited in order.
    double least(vec3 lower, vec3 upper) const;
    bool is_open(double least) const { return least <= most_; }
    /// Calls use(slot) for the children of a node whose boxes plain distances leave open.
    template <class Use>
    void for_each_open(const Node& node, Use use) const;
    /// Adds a triangle.
    void add(const NumberedTriangle& triangle);
    void add(const Leaf& leaf);
    /// Ends the choice; kNoPrim if none was added.
    NumberedTriangle closest();

private:
    struct Candidate {
        double least;
        NumberedTriangle triangle;
        bool is_certain;
        std::array<double, 3> weights;
    };

    void set_middle(const dvec3& middle);
    double least_from_middle(const LeafVertex& x) const;

    dvec3 p_;
    /// Bounds are relative to the squared distance of this place, which keeps their digits.
    dvec3 reference_;
    double most_ = std::numeric_limits<double>::infinity();
    /// The closest place so far, the way from there to p, and a lower bound for it.
    dvec3 middle_;
    dvec3 to_p_;
    double least_of_middle_;
    /// Above the squared distance of the middle by more than a plain one is rounded.
    double plain_most_ = std::numeric_limits<double>::infinity();
    std::vector<Candidate> candidates_;
};

}  // namespace

NumberedTriangle triangle_of(const Leaf& leaf, std::uint32_t slot) {
    NumberedTriangle triangle{leaf.prim_id[slot], {}};
    for (uint i = 0; i < 3; ++i) {
        const LeafVertex& vertex = leaf.vertex[corner(leaf.vertex[slot].corners, i)];
        triangle.corners[i] = {vertex.x, vertex.y, vertex.z};
    }
    return triangle;
}

ExactPlace exact_place(const dvec3& p, const Corners& corners) {
    const DoublePlace found = place_in_doubles(p, dvec3(corners[0]), corners);
    if (found.is_certain) return found.place;
    const ExactDistance exact = exact_distance(p, corners);
    const mpz_class sum = exact.weights[0] + exact.weights[1] + exact.weights[2];
    ExactPlace place{};
    for (std::size_t i = 0; i < 3; ++i) {
        place.weights[i] = mpq_class(exact.weights[i], sum).get_d();
        place.point += dvec3(corners[i]) * place.weights[i];
    }
    return place;
}

double exact_distance_of(const dvec3& p, const Corners& corners) {
    const mpq_class distance2 = exact_distance(p, corners).distance2;
    // It may be below all doubles.
    const double most_tiny = distance2 == 0 ? 0 : std::numeric_limits<double>::min();
    return std::sqrt(std::max(distance2.get_d(), most_tiny));
}

ClosestChoice::ClosestChoice(const dvec3& p, vec3 lower, vec3 upper)
    : p_(p), reference_(glm::clamp(p, dvec3(lower), dvec3(upper))) {
    set_middle(reference_);
}

double ClosestChoice::least(vec3 lower, vec3 upper) const {
    return difference(p_, reference_, glm::clamp(p_, dvec3(lower), dvec3(upper)), 0).least();
}

template <class Use>
void ClosestChoice::for_each_open(const Node& node, Use use) const {
    std::array<double, kWidth> distance2;
    // By value: a compiler makes vectors of this.
    const auto larger = [](double a, double b) { return a > b ? a : b; };
    const auto beyond = [&](double lower, double upper, double p) {
        return larger(larger(lower - p, p - upper), 0.0);
    };
    for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
        const double x = beyond(node.lower_x[slot], node.upper_x[slot], p_.x);
        const double y = beyond(node.lower_y[slot], node.upper_y[slot], p_.y);
        const double z = beyond(node.lower_z[slot], node.upper_z[slot], p_.z);
        distance2[slot] = x * x + y * y + z * z;
    }
    for (std::uint32_t slot = 0; slot < kWidth && node.child[slot] != kEmptyChild; ++slot)
        if (distance2[slot] <= plain_most_) use(slot);
}

/// A lower bound of a place x, and for the least corner that of a triangle. For the point m that
/// set_middle() was given, |p - x|^2 = |p - m|^2 + 2 (p - m).(m - x) + |m - x|^2, which is linear
/// in x without the last square.
double ClosestChoice::least_from_middle(const LeafVertex& x) const {
    const dvec3 part = 2.0 * to_p_ * (middle_ - dvec3(x.x, x.y, x.z));
    const double size = std::abs(part.x) + std::abs(part.y) + std::abs(part.z);
    return least_of_middle_ +
           (part.x + part.y + part.z - kDistanceRounding * (size + std::abs(least_of_middle_)));
}

void ClosestChoice::add(const Leaf& leaf) {
    std::array<double, kLeafVertices> least;
    for (std::uint32_t i = 0; i < kLeafVertices; ++i) least[i] = least_from_middle(leaf.vertex[i]);
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    for (std::uint32_t slot = 0; slot < count; ++slot) {
        const std::uint32_t packed = leaf.vertex[slot].corners;
        if (!is_open(least[corner(packed, 0)]) && !is_open(least[corner(packed, 1)]) &&
            !is_open(least[corner(packed, 2)]))
            continue;
        add(triangle_of(leaf, slot));
    }
}

void ClosestChoice::set_middle(const dvec3& middle) {
    middle_ = middle;
    to_p_ = p_ - middle;
    least_of_middle_ = difference(p_, reference_, middle, 0).least();
}

void ClosestChoice::add(const NumberedTriangle& triangle) {
    const Corners& corners = triangle.corners;
    if (!finite_vertices(corners[0], corners[1], corners[2])) return;
    Box box;
    for (const vec3& corner : corners) box.extend(corner);
    double bound = least(box.lower, box.upper);
    if (!is_open(bound)) return;
    const DoublePlace found = place_in_doubles(p_, reference_, corners);
    const Difference distance = difference(p_, reference_, found.place.point, blur_of(corners));
    if (found.is_certain) bound = distance.least();
    if (!is_open(bound)) return;
    if (distance.most() < most_) {
        most_ = distance.most();
        set_middle(found.place.point);
        // The middle is off by less than the second term.
        const double most = glm::length(to_p_) + 0x1p-28;
        plain_most_ = most * most * (1 + 0x1p-40);
    }
    candidates_.push_back({bound, triangle, found.is_certain, found.place.weights});
}

NumberedTriangle ClosestChoice::closest() {
    std::erase_if(candidates_, [&](const auto& candidate) { return !is_open(candidate.least); });
    std::ranges::sort(candidates_, {},
                      [](const auto& candidate) { return candidate.triangle.prim_id; });
    // Triangles that meet in the place are equally close: the first of them stands for all.
    std::vector<Feature> known;
    std::erase_if(candidates_, [&](const Candidate& candidate) {
        if (!candidate.is_certain) return false;
        const Feature feature = feature_of(candidate.triangle.corners, candidate.weights);
        if (std::ranges::find(known, feature) != known.end()) return true;
        known.push_back(feature);
        return false;
    });
    if (candidates_.empty()) return {kNoPrim, {}};
    const Candidate* closest = &candidates_.front();
    if (candidates_.size() == 1) return closest->triangle;
    mpq_class distance2;
    for (const Candidate& candidate : candidates_) {
        const mpq_class own2 = exact_distance(p_, candidate.triangle.corners).distance2;
        if (&candidate != &candidates_.front() && own2 >= distance2) continue;
        closest = &candidate;
        distance2 = own2;
    }
    return closest->triangle;
}

NumberedTriangle exact_closest(const dvec3& p, std::span<const NumberedTriangle> triangles) {
    if (triangles.size() == 1) return triangles.front();
    Box first;
    for (const vec3& corner : triangles.front().corners) first.extend(corner);
    ClosestChoice choice(p, first.lower, first.upper);
    for (const NumberedTriangle& triangle : triangles) choice.add(triangle);
    return choice.closest();
}

NumberedTriangle exact_closest(const Bvh& bvh, const dvec3& p) {
    const Box bounds = node_box(bvh.nodes[0]);
    ClosestChoice choice(p, bounds.lower, bounds.upper);
    struct Entry {
        double least;
        std::uint32_t child;
    };
    std::array<Entry, kMaxStack> stack;
    stack[0] = {-std::numeric_limits<double>::infinity(), 0};
    for (std::size_t size = 1; size > 0;) {
        const Entry entry = stack[--size];
        if (!choice.is_open(entry.least)) continue;
        if ((entry.child & kLeafBit) != 0) {
            choice.add(bvh.leaves[entry.child & ~kLeafBit]);
            continue;
        }
        const Node& node = bvh.nodes[entry.child];
        const std::size_t base = size;
        choice.for_each_open(node, [&](std::uint32_t slot) {
            const Box box = slot_box(node, slot);
            const Entry next{choice.least(box.lower, box.upper), node.child[slot]};
            if (!choice.is_open(next.least)) return;
            // The nearest last.
            std::size_t at = size++;
            for (; at > base && stack[at - 1].least < next.least; --at) stack[at] = stack[at - 1];
            stack[at] = next;
        });
    }
    return choice.closest();
}

}  // namespace mray
