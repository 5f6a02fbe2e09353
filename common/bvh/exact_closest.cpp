#include "common/bvh/exact_closest.h"

#include <gmpxx.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <glm/common.hpp>

#include "common/bvh/box.h"
#include "common/interop/hit_rule.h"

namespace mray {
namespace {

// Bounds of the errors of a dozen roundings, by the largest number in them.
constexpr double kRounding = 0x1p-49;

double dot(const dvec3& a, const dvec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double length(const dvec3& a) { return std::sqrt(dot(a, a)); }

/// Bounds of |p - q|^2 - |p - r|^2.
struct Difference {
    double value;
    double error;

    double least() const { return value - error; }
    double most() const { return value + error; }
};

/// `blur` is by how much q may be off, on each axis.
Difference difference(const dvec3& p, const dvec3& r, const dvec3& q, double blur) {
    Difference result{0, 0};
    for (int axis = 0; axis < 3; ++axis) {
        const double across = r[axis] - q[axis];
        const double from_q = p[axis] - q[axis];
        const double from_r = p[axis] - r[axis];
        const double size = std::abs(from_q) + std::abs(from_r);
        result.value += across * (from_q + from_r);
        result.error += (kRounding * std::abs(across) + 2 * blur + 0x1p-90 * size) * size;
    }
    result.error += 3 * blur * blur;
    return result;
}

/// A place on a triangle in doubles.
struct DoublePlace {
    ExactPlace place;
    /// Whether all corners have a part in it that should, and no others.
    bool is_certain = false;
};

/// How much weights of a corner may be off that is `size` beside the others, seen from `far`.
double weight_error(double far, double size) { return kRounding * far / size; }

/// The place inside the triangle, if p is over the inside; sets `is_certain` by whether that is
/// known. Weights are found along the longest edge and across it, as in closest_on_triangle().
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

/// The place on the edge i, and whether it is known where it ends.
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

/// Corners that have a part in a place, the others as the first of them, in the order of their
/// coordinates.
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

/// The error of places in doubles.
double blur_of(const Corners& corners) {
    double largest = 0;
    for (const vec3& corner : corners)
        for (int axis = 0; axis < 3; ++axis)
            largest = std::max(largest, static_cast<double>(std::abs(corner[axis])));
    return kRounding * largest;
}

/// The place, and its squared distance less that of r.
DoublePlace place_in_doubles(const dvec3& p, const dvec3& r, const Corners& corners,
                             Difference& distance) {
    const std::array<dvec3, 3> x = {dvec3(corners[0]), dvec3(corners[1]), dvec3(corners[2])};
    const double blur = blur_of(corners);
    DoublePlace inside;
    if (is_inside(p, x, inside)) {
        distance = difference(p, r, inside.place.point, blur);
        return inside;
    }
    DoublePlace edges[3];
    Difference distances[3];
    int nearest = 0;
    for (int i = 0; i < 3; ++i) {
        edges[i] = place_on_edge(p, x, i);
        distances[i] = difference(p, r, edges[i].place.point, blur);
        if (distances[i].value < distances[nearest].value) nearest = i;
    }
    bool is_certain = inside.is_certain;
    for (int i = 0; i < 3; ++i) {
        if (distances[i].least() > distances[nearest].most()) continue;
        is_certain &= edges[i].is_certain &&
                      (i == nearest || feature_of(corners, edges[i].place.weights) ==
                                           feature_of(corners, edges[nearest].place.weights));
    }
    distance = distances[nearest];
    edges[nearest].is_certain = is_certain;
    return edges[nearest];
}

/// A vector in units of a power of two in which all coordinates are whole.
struct WholeVector {
    mpz_class x;
    mpz_class y;
    mpz_class z;
};

WholeVector operator-(const WholeVector& a, const WholeVector& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
mpz_class dot(const WholeVector& a, const WholeVector& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
WholeVector cross(const WholeVector& a, const WholeVector& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Makes numbers whole that are multiples of 2^-digits.
class Unit {
public:
    Unit(const dvec3& p, const Corners& corners) {
        extend(p);
        for (const vec3& corner : corners) extend(corner);
    }

    WholeVector operator()(const dvec3& v) const { return {whole(v.x), whole(v.y), whole(v.z)}; }
    /// The square of a length in this unit, in squares of 1.
    mpq_class square(mpq_class length2) const {
        mpq_div_2exp(length2.get_mpq_t(), length2.get_mpq_t(), 2 * digits_);
        return length2;
    }

private:
    void extend(const dvec3& v) {
        for (int axis = 0; axis < 3; ++axis) {
            if (v[axis] == 0) continue;
            const int digits = 52 - std::ilogb(v[axis]);
            digits_ = std::max(digits_, static_cast<mp_bitcnt_t>(std::max(digits, 0)));
        }
    }
    mpz_class whole(double x) const {
        int exponent = 0;
        mpz_class z(std::ldexp(std::frexp(x, &exponent), 53));
        const int shift = exponent - 53 + static_cast<int>(digits_);
        mpz_mul_2exp(z.get_mpz_t(), z.get_mpz_t(), static_cast<mp_bitcnt_t>(std::max(shift, 0)));
        return z;
    }

    mp_bitcnt_t digits_ = 0;
};

struct ExactDistance {
    mpq_class distance2;
    /// Those of the corners, times some number.
    std::array<mpz_class, 3> weights;
};

ExactDistance exact_distance(const dvec3& p, const Corners& corners) {
    const Unit unit(p, corners);
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
        least = std::min(least, value - kRounding * (size + std::abs(least_of_middle_)));
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
