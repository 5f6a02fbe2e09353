#include "common/bvh/exact_closest.h"

#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "common/base/whole_vector.h"
#include "common/interop/hit_rule.h"

namespace mray {
namespace {

// Bounds of the errors of a dozen roundings, by the largest number in them.
constexpr double kDistanceRounding = 0x1p-49;

/// Bounds of |p - q|^2 - |p - r|^2.
struct Difference {
    double value;
    double error;

    double least() const { return value - error; }
    double most() const { return value + error; }
};
/// As p and r are given; q is off by up to `blur` on each axis.
Difference difference(const dvec3& p, const dvec3& r, const dvec3& q, double blur) {
    Difference result{0, 0};
    for (int axis = 0; axis < 3; ++axis) {
        const double across = r[axis] - q[axis];
        const double from_q = p[axis] - q[axis];
        const double from_r = p[axis] - r[axis];
        const double size = std::abs(from_q) + std::abs(from_r);
        result.value += across * (from_q + from_r);
        result.error += (kDistanceRounding * std::abs(across) + 2 * blur + 0x1p-90 * size) * size;
    }
    result.error += 3 * blur * blur;
    return result;
}

struct DoublePlace {
    ExactPlace place;
    /// True if exact numbers give 0 for the same weights.
    bool is_certain = false;
};

/// A bound of the error of a corner's weight: `size` is its distance from the line through the
/// others, and `far` at least that of the point from any corner.
double weight_error(double far, double size) { return kDistanceRounding * far / size; }

/// The place inside the triangle, if p is over the inside; sets `is_certain` by whether that is
/// known. Weights are found along the longest edge and across it, as in triangle_distance2().
bool is_inside(const dvec3& p, const std::array<dvec3, 3>& x, DoublePlace& inside) {
    int first = 0;
    double longest2 = -1;
    for (int i = 0; i < 3; ++i) {
        const dvec3 edge = x[(i + 1) % 3] - x[i];
        const double length2 = dot(edge, edge);
        if (length2 > longest2) {
            longest2 = length2;
            first = i;
        }
    }
    const int second = (first + 1) % 3;
    const int third = (first + 2) % 3;
    const dvec3 e = x[second] - x[first];
    const dvec3 f = x[third] - x[first];
    const dvec3 t = p - x[first];
    const double r_along = dot(f, e) / longest2;
    const dvec3 height = f - e * r_along;
    const double height2 = dot(height, height);
    const double along = dot(t, e) / longest2;
    const double of_r = dot(t - e * along, height) / height2;
    const double of_q = along - of_r * r_along;
    const double of_p = 1 - of_q - of_r;
    const double far = length(t) + std::sqrt(longest2) * (1 + std::abs(of_r));
    const double error = weight_error(far, std::sqrt(height2));
    const double least = std::min({of_p, of_q, of_r});
    // False for numbers that are not finite.
    inside.is_certain = std::abs(least) > error;
    inside.place.weights[static_cast<std::size_t>(first)] = of_p;
    inside.place.weights[static_cast<std::size_t>(second)] = of_q;
    inside.place.weights[static_cast<std::size_t>(third)] = of_r;
    inside.place.point = x[first] + e * of_q + f * of_r;
    return inside.is_certain && least > 0;
}

DoublePlace place_on_edge(const dvec3& p, const std::array<dvec3, 3>& x, int i) {
    const int j = (i + 1) % 3;
    const dvec3 e = x[j] - x[i];
    const dvec3 t = p - x[i];
    const double length2 = dot(e, e);
    const double at = length2 > 0 ? dot(t, e) / length2 : 0;
    const double size = std::sqrt(length2);
    const double s = std::clamp(at, 0.0, 1.0);
    DoublePlace on_edge;
    on_edge.is_certain =
        std::min(std::abs(at), std::abs(1 - at)) > weight_error(length(t) + size, size);
    on_edge.place.weights = {};
    on_edge.place.weights[static_cast<std::size_t>(i)] = 1 - s;
    on_edge.place.weights[static_cast<std::size_t>(j)] = s;
    on_edge.place.point = s == 1 ? x[j] : x[i] + e * s;
    return on_edge;
}

/// The most by which a coordinate of a place in doubles differs from the exact one.
double blur_of(const Corners& corners) {
    double largest = 0;
    for (const vec3& corner : corners)
        for (int axis = 0; axis < 3; ++axis)
            largest = std::max(largest, static_cast<double>(std::abs(corner[axis])));
    return kDistanceRounding * largest;
}

/// Corners that have a part in a place, others as the first of them, in order.
using Feature = std::array<std::array<float, 3>, 3>;

Feature feature_of(const Corners& corners, const std::array<double, 3>& weights) {
    Feature feature = {};
    std::size_t first = 0;
    while (weights[first] == 0) ++first;
    for (std::size_t i = 0; i < 3; ++i) {
        const vec3& corner = corners[weights[i] != 0 ? i : first];
        feature[i] = {corner.x, corner.y, corner.z};
    }
    std::sort(feature.begin(), feature.end());
    // Two of a vertex or three: one thing.
    if (feature[0] == feature[1]) feature[1] = feature[2];
    return feature;
}

/// Sets the place to the corner nearest to p and returns true if both edges there surely lead away
/// from p, or exactly across: where all products have a factor of 0.
bool is_at_corner(const dvec3& p, const std::array<dvec3, 3>& x, DoublePlace& found) {
    std::size_t nearest = 0;
    std::array<double, 3> distance2;
    for (std::size_t i = 0; i < 3; ++i) {
        const dvec3 t = x[i] - p;
        distance2[i] = dot(t, t);
        if (distance2[i] < distance2[nearest]) nearest = i;
    }
    const dvec3 t = x[nearest] - p;
    for (std::size_t other = 1; other < 3; ++other) {
        const dvec3 along = t * (x[(nearest + other) % 3] - x[nearest]);
        const double size = std::abs(along.x) + std::abs(along.y) + std::abs(along.z);
        if (!(along.x + along.y + along.z > kDistanceRounding * size || size == 0)) return false;
    }
    found.is_certain = true;
    found.place.weights = {};
    found.place.weights[nearest] = 1;
    found.place.point = x[nearest];
    return true;
}

/// Finds the place on a triangle that is the closest one to p. Squared distances are compared after
/// that of the nearby point r is subtracted, which keeps their digits.
DoublePlace place_in_doubles(const dvec3& p, const dvec3& r, const Corners& corners) {
    const std::array<dvec3, 3> x = {dvec3(corners[0]), dvec3(corners[1]), dvec3(corners[2])};
    DoublePlace found;
    if (is_at_corner(p, x, found) || is_inside(p, x, found)) return found;
    const double blur = blur_of(corners);
    DoublePlace edges[3];
    Difference distances[3];
    int nearest = 0;
    for (int i = 0; i < 3; ++i) {
        edges[i] = place_on_edge(p, x, i);
        distances[i] = difference(p, r, edges[i].place.point, blur);
        if (distances[i].value < distances[nearest].value) nearest = i;
    }
    bool is_certain = found.is_certain;
    for (int i = 0; i < 3; ++i) {
        if (distances[i].least() > distances[nearest].most()) continue;
        is_certain &= edges[i].is_certain &&
                      (i == nearest || feature_of(corners, edges[i].place.weights) ==
                                           feature_of(corners, edges[nearest].place.weights));
    }
    return {edges[nearest].place, is_certain};
}

/// The closest place of a triangle in integers of any length.
struct ExactDistance {
    mpq_class distance2;
    /// The barycentric weights of the corners, times a common factor.
    std::array<mpz_class, 3> weights;
};

ExactDistance exact_distance(const dvec3& p, const Corners& corners) {
    const WholeUnit unit(p, corners[0], corners[1], corners[2]);
    const WholeVector q = unit(p);
    const WholeVector x[3] = {unit(corners[0]), unit(corners[1]), unit(corners[2])};
    const WholeVector t[3] = {q - x[0], q - x[1], q - x[2]};
    const WholeVector normal = cross(x[1] - x[0], x[2] - x[0]);
    ExactDistance inside;
    bool is_inside = true;
    for (std::size_t i = 0; i < 3; ++i) {
        inside.weights[i] = dot(normal, cross(t[(i + 1) % 3], t[(i + 2) % 3]));
        is_inside &= inside.weights[i] > 0;
    }
    if (is_inside) {
        const mpz_class height = dot(normal, t[0]);
        inside.distance2 = unit.square(mpq_class(height * height, dot(normal, normal)));
        inside.distance2.canonicalize();
        return inside;
    }
    ExactDistance nearest;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        const WholeVector e = x[j] - x[i];
        const mpz_class length2 = dot(e, e);
        const mpz_class along = dot(t[i], e);
        ExactDistance edge;
        if (along <= 0) {
            edge.weights[i] = 1;
            edge.distance2 = dot(t[i], t[i]);
        } else if (along >= length2) {
            edge.weights[j] = 1;
            edge.distance2 = dot(t[j], t[j]);
        } else {
            edge.weights[i] = length2 - along;
            edge.weights[j] = along;
            edge.distance2 = mpq_class(dot(t[i], t[i]) * length2 - along * along, length2);
            edge.distance2.canonicalize();
        }
        edge.distance2 = unit.square(edge.distance2);
        if (i == 0 || edge.distance2 < nearest.distance2) nearest = edge;
    }
    return nearest;
}

/// The closest triangle to a point among some, the lowest prim_id of equally close ones.
class ClosestChoice {
public:
    ClosestChoice(const dvec3& p, vec3 lower, vec3 upper)
        : p_(p),
          reference_(glm::clamp(p, dvec3(lower), dvec3(upper))),
          largest_(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)})) {
        set_middle(reference_);
    }

    /// A lower bound, by which boxes may be visited in order.
    double least(vec3 lower, vec3 upper) const {
        return difference(p_, reference_, glm::clamp(p_, dvec3(lower), dvec3(upper)), 0).least();
    }

    bool is_open(double least) const { return least <= most_; }

    /// Calls use(slot, child) for the children of a node whose boxes plain distances leave open.
    template <class Use>
    void for_each_open(const Node& node, Use use) const {
        PerSlot<double> distance2;
        // By value: a compiler makes vectors of this.
        const auto larger = [](double a, double b) { return a > b ? a : b; };
        const auto beyond = [&](double lower, double upper, double p) {
            return larger(larger(lower - p, p - upper), 0.0);
        };
        for (std::uint32_t slot = 0; slot < std::size(distance2); ++slot) {
            const double x = beyond(plane_of(node, 0, 0, slot), plane_of(node, 0, 1, slot), p_.x);
            const double y = beyond(plane_of(node, 1, 0, slot), plane_of(node, 1, 1, slot), p_.y);
            const double z = beyond(plane_of(node, 2, 0, slot), plane_of(node, 2, 1, slot), p_.z);
            distance2[slot] = x * x + y * y + z * z;
        }
        for_each_child(node, [&](std::uint32_t slot, std::uint32_t child) {
            if (distance2[slot] <= plain_most_) use(slot, child);
        });
    }

    /// number_of(prim_id) is the triangle's prim_id, or kNoPrim if it does not exist.
    template <class NumberOf>
    void add(const Leaf& leaf, NumberOf number_of) {
        PerVertex<double> least;
        for (std::size_t i = 0; i < std::size(least); ++i)
            least[i] = least_from_middle(leaf.vertex[i]);
        const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
        for (std::uint32_t slot = 0; slot < count; ++slot) {
            const std::uint32_t packed = leaf.vertex[slot].corners;
            if (!is_open(least[corner(packed, 0)]) && !is_open(least[corner(packed, 1)]) &&
                !is_open(least[corner(packed, 2)]))
                continue;
            NumberedTriangle triangle = triangle_of(leaf, slot);
            triangle.prim_id = number_of(triangle.prim_id);
            if (triangle.prim_id != kNoPrim) add(triangle);
        }
    }

    void add(const NumberedTriangle& triangle) {
        const Corners& corners = triangle.corners;
        if (!finite_vertices(corners[0], corners[1], corners[2])) return;
        Box box;
        for (const vec3& corner : corners) box.extend(corner);
        double bound = least(box.lower, box.upper);
        if (!is_open(bound) || is_behind_plane(corners)) return;
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
            const double rounding = 0x1p-46 * (2 * kSceneExtent + largest_);
            far_most_ = (most + rounding) * (most + rounding) * (1 + 0x1p-40);
        }
        candidates_.push_back({bound, triangle, found.is_certain, found.place.weights});
    }

    /// Ends the choice; kNoPrim if none was added.
    NumberedTriangle closest() {
        std::erase_if(candidates_,
                      [&](const auto& candidate) { return !is_open(candidate.least); });
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

private:
    struct Candidate {
        double least;
        NumberedTriangle triangle;
        bool is_certain;
        std::array<double, 3> weights;
    };

    /// True if the plane of the triangle is farther away than the nearest place found so far.
    bool is_behind_plane(const Corners& corners) const {
        const dvec3 a = dvec3(corners[0]) - p_;
        const dvec3 b = dvec3(corners[1]) - p_;
        const dvec3 c = dvec3(corners[2]) - p_;
        const dvec3 w = glm::cross(b - a, c - a);
        const double to_a = glm::dot(w, a), to_b = glm::dot(w, b), to_c = glm::dot(w, c);
        const double along = std::max(std::min({to_a, to_b, to_c}), -std::max({to_a, to_b, to_c}));
        // Seven roundings of products; |a| <= |p - x| of the place x so far, and an edge's length.
        return along > 0 && along * along > glm::dot(w, w) * far_most_;
    }

    void set_middle(const dvec3& middle) {
        middle_ = middle;
        to_p_ = p_ - middle;
        least_of_middle_ = difference(p_, reference_, middle, 0).least();
    }

    /// A lower bound of a place x, and for the least corner of a triangle, linear in x: for the
    /// middle m, |p - x|^2 = |p - m|^2 + 2 (p - m).(m - x) + |m - x|^2.
    double least_from_middle(const LeafVertex& x) const {
        const dvec3 part = 2.0 * to_p_ * (middle_ - dvec3(x.x, x.y, x.z));
        const double size = std::abs(part.x) + std::abs(part.y) + std::abs(part.z);
        return least_of_middle_ +
               (part.x + part.y + part.z - kDistanceRounding * (size + std::abs(least_of_middle_)));
    }

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
    /// plain_most_ with room for the rounding of differences from the point.
    double far_most_ = std::numeric_limits<double>::infinity();
    /// The largest coordinate of the point.
    double largest_;
    std::vector<Candidate> candidates_;
};

}  // namespace

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

double distance_in_doubles(const dvec3& p, const Corners& corners,
                           const std::array<double, 3>& weights) {
    // Differences are relative to a corner of the place, so errors are parts of the way from there.
    std::array<dvec3, 3> x;
    std::size_t count = 0;
    for (std::size_t i = 0; i < 3; ++i)
        if (weights[i] != 0) x[count++] = dvec3(corners[i]);
    const dvec3 t = p - x[0];
    if (count == 1) return length(t);
    const dvec3 e = x[1] - x[0];
    const dvec3 f = count == 2 ? t : x[2] - x[0];
    const dvec3 normal = glm::cross(e, f);
    const double normal2 = dot(normal, normal);
    const double product2 = dot(e, e) * dot(f, f);
    // The cross product is off by at most kDistanceRounding |e| |f|.
    if (count == 2) return product2 <= 0x1p+50 * normal2 ? std::sqrt(normal2 / dot(e, e)) : 0;
    // Seven roundings of the six products of a determinant (J. R. Shewchuk. Adaptive Precision
    // Floating-Point Arithmetic and Fast Robust Geometric Predicates. DCG 18(3), 1997).
    const dvec3 a = glm::abs(e), b = glm::abs(f);
    const dvec3 sizes(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x);
    const double height = std::abs(dot(normal, t));
    const bool is_certain = 0x1p-50 * dot(sizes, glm::abs(t)) <= 0x1p-24 * height;
    return is_certain && product2 <= 0x1p+40 * normal2 ? height / std::sqrt(normal2) : 0;
}

NumberedTriangle triangle_of(const Leaf& leaf, std::uint32_t slot) {
    NumberedTriangle triangle{leaf.prim_id[slot], {}};
    for (uint i = 0; i < 3; ++i) {
        const LeafVertex& vertex = leaf.vertex[corner(leaf.vertex[slot].corners, i)];
        triangle.corners[i] = {vertex.x, vertex.y, vertex.z};
    }
    return triangle;
}

NumberedTriangle exact_closest(const dvec3& p, std::span<const NumberedTriangle> triangles) {
    if (triangles.size() == 1) return triangles.front();
    Box first;
    for (const vec3& corner : triangles.front().corners) first.extend(corner);
    ClosestChoice choice(p, first.lower, first.upper);
    for (const NumberedTriangle& triangle : triangles) choice.add(triangle);
    return choice.closest();
}

NumberedTriangle exact_closest(const Bvh& bvh, const dvec3& p,
                               const std::function<bool(std::uint32_t prim_id)>& sees) {
    const auto number_of = [&](std::uint32_t prim_id) {
        return sees ? first_seen(bvh, prim_id, sees) : prim_id;
    };
    const Box bounds = node_box(bvh.nodes[0]);
    ClosestChoice choice(p, bounds.lower, bounds.upper);
    struct Entry {
        double least;
        std::uint32_t child;
    };
    TraversalStack<Entry> stack;
    stack[0] = {-std::numeric_limits<double>::infinity(), 0};
    for (std::size_t size = 1; size > 0;) {
        const Entry entry = stack[--size];
        if (!choice.is_open(entry.least)) continue;
        if (is_leaf(entry.child)) {
            choice.add(bvh.leaves[leaf_of(entry.child)], number_of);
            continue;
        }
        const Node& node = bvh.nodes[entry.child];
        const std::size_t base = size;
        choice.for_each_open(node, [&](std::uint32_t slot, std::uint32_t child) {
            const Box box = slot_box(node, slot);
            const Entry next{choice.least(box.lower, box.upper), child};
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
