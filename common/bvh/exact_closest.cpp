#include "common/bvh/exact_closest.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <glm/common.hpp>

#include "common/bvh/box.h"
#include "common/bvh/triangle_distance.h"
#include "common/interop/hit_rule.h"

namespace mray {
namespace {

/// The closest triangle to a point among some, the lowest prim_id of equally close ones.
class ClosestChoice {
public:
    /// `lower` and `upper` are those of a box around the triangles.
    ClosestChoice(const dvec3& p, vec3 lower, vec3 upper);

    /// A lower bound, by which boxes may be visited in order.
    double least(vec3 lower, vec3 upper) const;
    /// False if nothing at this distance or farther is the closest.
    bool is_open(double least) const { return least <= most_; }
    void add(std::uint32_t prim_id, const Corners& corners);
    /// kNoPrim if none was added.
    std::uint32_t closest() const;

private:
    struct Candidate {
        double least;
        std::uint32_t prim_id;
        Corners corners;
        /// DoublePlace::is_certain.
        bool is_certain;
        std::array<double, 3> weights;
    };

    void set_middle(const dvec3& middle);
    /// A lower bound that is tight for triangles near the middle.
    double least_from_middle(const Corners& corners) const;

    dvec3 p_;
    /// Bounds are differences of squared distances from that of this place, which keeps their
    /// digits from far away.
    dvec3 reference_;
    double most_ = std::numeric_limits<double>::infinity();
    /// The closest place so far, the way from there to p, and a lower bound for it.
    dvec3 middle_;
    dvec3 to_p_;
    double least_of_middle_;
    std::vector<Candidate> candidates_;
};

/// Adds the triangles of a leaf but `guess`, which has been added.
void add_leaf(const Leaf& leaf, std::uint32_t guess, ClosestChoice& choice) {
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    for (std::uint32_t slot = 0; slot < count; ++slot) {
        if (leaf.prim_id[slot] == guess) continue;
        Corners corners;
        for (uint i = 0; i < 3; ++i) {
            const LeafVertex& vertex = leaf.vertex[corner(leaf.vertex[slot].corners, i)];
            corners[i] = {vertex.x, vertex.y, vertex.z};
        }
        choice.add(leaf.prim_id[slot], corners);
    }
}

}  // namespace

ExactPlace exact_place(const dvec3& p, const Corners& corners) {
    Difference distance{};
    const DoublePlace found = place_in_doubles(p, dvec3(corners[0]), corners, distance);
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

ClosestChoice::ClosestChoice(const dvec3& p, vec3 lower, vec3 upper)
    : p_(p), reference_(glm::clamp(p, dvec3(lower), dvec3(upper))) {
    set_middle(reference_);
}

double ClosestChoice::least(vec3 lower, vec3 upper) const {
    return difference(p_, reference_, glm::clamp(p_, dvec3(lower), dvec3(upper)), 0).least();
}

/// For the point m that set_middle() was given and a point x of the triangle,
/// |p - x|^2 = |p - m|^2 + 2 (p - m).(m - x) + |m - x|^2. Without the last square this is linear in
/// x, and least at a corner.
double ClosestChoice::least_from_middle(const Corners& corners) const {
    double least = std::numeric_limits<double>::infinity();
    for (const vec3& corner : corners) {
        double value = 0;
        double size = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double part = 2 * to_p_[axis] * (middle_[axis] - double{corner[axis]});
            value += part;
            size += std::abs(part);
        }
        least = std::min(least, value - kDistanceRounding * (size + std::abs(least_of_middle_)));
    }
    return least_of_middle_ + least;
}

void ClosestChoice::set_middle(const dvec3& middle) {
    middle_ = middle;
    to_p_ = p_ - middle;
    least_of_middle_ = difference(p_, reference_, middle, 0).least();
}

void ClosestChoice::add(std::uint32_t prim_id, const Corners& corners) {
    if (!finite_vertices(corners[0], corners[1], corners[2])) return;
    if (!is_open(least_from_middle(corners))) return;
    Box box;
    for (const vec3& corner : corners) box.extend(corner);
    double bound = least(box.lower, box.upper);
    if (!is_open(bound)) return;
    Difference distance{};
    const DoublePlace found = place_in_doubles(p_, reference_, corners, distance);
    if (found.is_certain) bound = distance.least();
    if (!is_open(bound)) return;
    if (distance.most() < most_) {
        most_ = distance.most();
        set_middle(found.place.point);
    }
    candidates_.push_back({bound, prim_id, corners, found.is_certain, found.place.weights});
}

std::uint32_t ClosestChoice::closest() const {
    std::vector<const Candidate*> open;
    for (const Candidate& candidate : candidates_)
        if (is_open(candidate.least)) open.push_back(&candidate);
    if (open.empty()) return kNoPrim;
    std::ranges::sort(open, {}, &Candidate::prim_id);
    // Triangles that meet in the place are equally close.
    std::vector<Feature> known;
    std::vector<const Candidate*> others;
    for (const Candidate* const candidate : open) {
        if (candidate->is_certain) {
            const Feature feature = feature_of(candidate->corners, candidate->weights);
            if (std::ranges::find(known, feature) != known.end()) continue;
            known.push_back(feature);
        }
        others.push_back(candidate);
    }
    if (others.size() == 1) return others[0]->prim_id;
    const Candidate* closest = nullptr;
    mpq_class distance2;
    for (const Candidate* const candidate : others) {
        const mpq_class own2 = exact_distance(p_, candidate->corners).distance2;
        if (closest != nullptr && own2 >= distance2) continue;
        closest = candidate;
        distance2 = own2;
    }
    return closest->prim_id;
}

std::uint32_t exact_closest(const Bvh& bvh, const dvec3& p, std::uint32_t guess,
                            const Corners& of_guess) {
    Box bounds;
    for (std::uint32_t slot = 0; slot < kWidth; ++slot) bounds.extend(slot_box(bvh.nodes[0], slot));
    ClosestChoice choice(p, bounds.lower, bounds.upper);
    if (guess != kNoPrim) choice.add(guess, of_guess);
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
            add_leaf(bvh.leaves[entry.child & ~kLeafBit], guess, choice);
            continue;
        }
        const Node& node = bvh.nodes[entry.child];
        const std::size_t base = size;
        for (std::uint32_t slot = 0; slot < kWidth && node.child[slot] != kEmptyChild; ++slot) {
            const Box box = slot_box(node, slot);
            const Entry next{choice.least(box.lower, box.upper), node.child[slot]};
            if (!choice.is_open(next.least)) continue;
            // The nearest last.
            std::size_t at = size++;
            for (; at > base && stack[at - 1].least < next.least; --at) stack[at] = stack[at - 1];
            stack[at] = next;
        }
    }
    return choice.closest();
}

}  // namespace mray
