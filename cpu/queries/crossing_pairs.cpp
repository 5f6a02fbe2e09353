#include "cpu/queries/crossing_pairs.h"

#include <algorithm>
#include <bit>
#include <iterator>

#include "common/scene/triangle_crossing.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/queries/crossing_pairs.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/simd/node-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// ---- Planes that separate two triangles, in lanes of doubles

using DoubleTag = hn::CappedTag<double, 8>;
using DoubleVec = hn::Vec<DoubleTag>;
using DoubleMask = hn::Mask<DoubleTag>;
inline constexpr DoubleTag kDoubles;
inline constexpr std::size_t kPairLanes = hn::MaxLanes(kDoubles);

struct Double3 {
    DoubleVec x, y, z;
};
HWY_INLINE Double3 operator-(const Double3& a, const Double3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
HWY_INLINE Double3 operator+(const Double3& a, const Double3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
HWY_INLINE Double3 operator*(const Double3& a, DoubleVec b) { return {a.x * b, a.y * b, a.z * b}; }
HWY_INLINE Double3 sizes(const Double3& v) { return {hn::Abs(v.x), hn::Abs(v.y), hn::Abs(v.z)}; }
HWY_INLINE Double3 largest(const Double3& a, const Double3& b) {
    return {hn::Max(a.x, b.x), hn::Max(a.y, b.y), hn::Max(a.z, b.z)};
}
HWY_INLINE DoubleVec dot(const Double3& a, const Double3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
HWY_INLINE Double3 cross(const Double3& a, const Double3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// Of any length: as the normal of a plane, a vector may be rounded. Not a number for 0.
HWY_INLINE Double3 unit(const Double3& v) {
    return v * (hn::Set(kDoubles, 1.0) / hn::Sqrt(dot(v, v)));
}
HWY_INLINE DoubleVec splat_double(double x) { return hn::Set(kDoubles, x); }

/// As many pairs as lanes. Triangles have shared vertices first, in the same order.
struct PairBatch {
    std::size_t count = 0;
    TrianglePair pairs[kPairLanes];
    float corners[2][3][3][kPairLanes] = {};

    HWY_INLINE Double3 corner(std::size_t side, std::size_t i) const {
        const hn::Rebind<float, DoubleTag> floats;
        const auto at = [&](std::size_t axis) HWY_ATTR {
            return hn::PromoteTo(kDoubles, hn::LoadU(floats, corners[side][i][axis]));
        };
        return {at(0), at(1), at(2)};
    }
};

// The normals of planes may be rounded: only that corners are surely above or below them counts.

/// Whether a normal surely has the differences on this side.
HWY_INLINE DoubleMask surely_above(const Double3& normal, const Double3& v) {
    return dot(normal, v) > splat_double(kPlaneRounding) * dot(sizes(normal), sizes(v));
}

/// Pairs of triangles without a common vertex.
HWY_INLINE DoubleMask are_separate(const Double3 a[3], const Double3 b[3]) {
    const Double3 edge = a[1] - a[0];
    const Double3 edge2 = a[2] - a[0];
    const Double3 from_a[] = {b[0] - a[0], b[1] - a[0], b[2] - a[0]};
    Double3 most = largest(sizes(edge), sizes(edge2));
    for (const Double3& v : from_a) most = largest(most, sizes(v));
    const DoubleVec none = hn::Zero(kDoubles);
    const auto separates = [&](const Double3& normal) HWY_ATTR {
        const DoubleVec p = dot(normal, edge), q = dot(normal, edge2);
        DoubleVec d[3];
        for (int i = 0; i < 3; ++i) d[i] = dot(normal, from_a[i]);
        // Two of them are compared, which rounds once more.
        const DoubleVec error =
            splat_double(4 * kPlaneRounding) * dot(sizes(normal), most);
        return hn::Or(hn::Min(d[0], hn::Min(d[1], d[2])) - hn::Max(none, hn::Max(p, q)) > error,
                      hn::Min(none, hn::Min(p, q)) - hn::Max(d[0], hn::Max(d[1], d[2])) > error);
    };
    DoubleMask found = separates(from_a[0] + from_a[1] + from_a[2] - edge - edge2);
    const auto try_normal = [&](const Double3& normal) HWY_ATTR {
        if (!hn::AllTrue(kDoubles, found)) found = hn::Or(found, separates(normal));
    };
    const Double3 normal_a = cross(edge, edge2);
    const Double3 edge_b = b[1] - b[0], edge2_b = b[2] - b[0];
    const Double3 normal_b = cross(edge_b, edge2_b);
    try_normal(normal_a);
    try_normal(normal_b);
    for (const Double3& e : {edge, edge2, edge2 - edge}) try_normal(cross(normal_a, e));
    for (const Double3& e : {edge_b, edge2_b, edge2_b - edge_b}) try_normal(cross(normal_b, e));
    for (const Double3& e : {edge, edge2, edge2 - edge})
        for (const Double3& f : {edge_b, edge2_b, edge2_b - edge_b}) try_normal(cross(e, f));
    return found;
}

/// Pairs with one common vertex: planes through it with all other corners of one triangle above and
/// those of the other one below.
HWY_INLINE DoubleMask meet_in_vertex(const Double3 a[3], const Double3 b[3]) {
    const Double3 p = a[1] - a[0], q = a[2] - a[0], r = b[1] - a[0], s = b[2] - a[0];
    const Double3 minus_r = a[0] - b[1], minus_s = a[0] - b[2];
    const auto separates = [&](const Double3& normal) HWY_ATTR {
        return hn::And(hn::And(surely_above(normal, p), surely_above(normal, q)),
                       hn::And(surely_above(normal, minus_r), surely_above(normal, minus_s)));
    };
    const Double3 p1 = unit(p), q1 = unit(q), r1 = unit(r), s1 = unit(s);
    DoubleMask found = separates(p1 + q1 - r1 - s1);
    const auto try_normal = [&](const Double3& normal) HWY_ATTR {
        if (!hn::AllTrue(kDoubles, found)) found = hn::Or(found, separates(normal));
    };
    try_normal(unit(p1 + q1) - unit(r1 + s1));
    // The plane of one triangle, turned about the vertex so that this triangle is above it, if the
    // other one, which is on one side, leaves room.
    const auto turned = [&](const Double3& normal, const Double3& own, const Double3& first,
                            const Double3& second) HWY_ATTR {
        const DoubleVec to_first = dot(normal, first), to_second = dot(normal, second);
        const DoubleVec slope = hn::Max(dot(own, first) / hn::Abs(to_first),
                                        dot(own, second) / hn::Abs(to_second));
        const DoubleVec by = hn::Max(splat_double(2) * slope, splat_double(0x1p-20));
        return own - normal * hn::CopySign(by, to_first);
    };
    try_normal(turned(unit(cross(p, q)), p1 + q1, r, s));
    try_normal(turned(unit(cross(r, s)), r1 + s1, p, q) * splat_double(-1));
    for (const Double3& own : {p1, q1})
        for (const Double3& others : {r1, s1}) try_normal(own - others);
    return found;
}

/// Pairs with a common edge: planes through it with the third corners on both sides. As normals
/// across the edge cannot be exact, the sides are those of triple products with it.
HWY_INLINE DoubleMask meet_in_edge(const Double3 a[3], const Double3 b[3]) {
    const Double3 edge = a[1] - a[0], c = a[2] - a[0], d = b[2] - a[0];
    const Double3 across_c = cross(c, edge), across_d = cross(d, edge);
    const Double3 along = unit(across_c) - unit(across_d);
    const auto error = [&](const Double3& v) HWY_ATTR {
        const Double3 e = sizes(edge), w = sizes(v);
        const Double3 products = {w.y * e.z + w.z * e.y, w.z * e.x + w.x * e.z,
                                  w.x * e.y + w.y * e.x};
        return splat_double(kSideRounding) * dot(sizes(along), products);
    };
    return hn::And(dot(along, across_c) > error(c), dot(along, across_d) < hn::Neg(error(d)));
}

// ---- Triangles and leaves

/// The pairs of one leaf, by the number of vertices that they share.
class PairTests {
public:
    PairTests(const CrossingScene& scene, std::vector<TrianglePair>& found)
        : scene_(scene), found_(found) {}

    void add(std::uint32_t first, std::uint32_t second) {
        const uvec3 a = scene_.topology.triangles[first];
        const uvec3 b = scene_.topology.triangles[second];
        // The corners in such an order that shared ones come first.
        std::uint32_t order_a[3], order_b[3];
        std::size_t shared = 0;
        std::uint32_t used_a = 0, used_b = 0;
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                if (a[i] != b[j]) continue;
                used_a |= 1u << i;
                used_b |= 1u << j;
                if (shared < 3) {
                    order_a[shared] = a[i];
                    order_b[shared++] = b[j];
                }
            }
        }
        const auto is_of = [](std::uint32_t bits, std::size_t count) {
            return static_cast<std::size_t>(std::popcount(bits)) == count;
        };
        // A triangle that has a vertex twice is tested as one that shares none.
        if (shared == 3 || !is_of(used_a, shared) || !is_of(used_b, shared)) {
            shared = 0;
            used_a = used_b = 0;
        }
        std::size_t at_a = shared, at_b = shared;
        for (int i = 0; i < 3; ++i) {
            if ((used_a >> i & 1) == 0) order_a[at_a++] = a[i];
            if ((used_b >> i & 1) == 0) order_b[at_b++] = b[i];
        }
        PairBatch& batch = batches_[shared];
        batch.pairs[batch.count] = {std::min(first, second), std::max(first, second)};
        for (std::size_t i = 0; i < 3; ++i) {
            for (int axis = 0; axis < 3; ++axis) {
                batch.corners[0][i][axis][batch.count] = scene_.positions[order_a[i]][axis];
                batch.corners[1][i][axis][batch.count] = scene_.positions[order_b[i]][axis];
            }
        }
        if (++batch.count == kPairLanes) test(shared);
    }

    void finish() {
        for (std::size_t shared = 0; shared < std::size(batches_); ++shared)
            if (batches_[shared].count != 0) test(shared);
    }

private:
    HWY_NOINLINE void test(std::size_t shared) {
        PairBatch& batch = batches_[shared];
        Double3 a[3], b[3];
        for (std::size_t i = 0; i < 3; ++i) {
            a[i] = batch.corner(0, i);
            b[i] = batch.corner(1, i);
        }
        const DoubleMask apart = shared == 0   ? are_separate(a, b)
                                 : shared == 1 ? meet_in_vertex(a, b)
                                               : meet_in_edge(a, b);
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(kDoubles, apart, bits);
        for (std::size_t i = 0; i < batch.count; ++i)
            if ((bits[0] >> i & 1) == 0 && cross_exactly(batch.pairs[i]))
                found_.push_back(batch.pairs[i]);
        batch.count = 0;
    }

    bool cross_exactly(const TrianglePair& pair) const {
        return triangles_cross(corners_of(pair.first), corners_of(pair.second));
    }
    std::array<vec3, 3> corners_of(std::uint32_t prim) const {
        const uvec3 t = scene_.topology.triangles[prim];
        return {scene_.positions[t.x], scene_.positions[t.y], scene_.positions[t.z]};
    }

    const CrossingScene& scene_;
    std::vector<TrianglePair>& found_;
    PairBatch batches_[3];
};

/// The triangles of a leaf that may cross others: their boxes, by axis and slot, and their sets.
struct LeafTriangles {
    alignas(64) float lower[3][kLeafTriangles], upper[3][kLeafTriangles];
    std::uint32_t in_first = 0, in_second = 0;
    std::uint32_t used = 0;
};

HWY_INLINE std::uint8_t sets_of(const CrossingScene& scene, std::uint32_t prim) {
    return scene.sets.empty() ? std::uint8_t{kInFirstSet | kInSecondSet} : scene.sets[prim];
}

HWY_INLINE void load_triangles(const CrossingScene& scene, const Leaf& leaf, LeafTriangles& out) {
    for (std::uint32_t i = 0; i < kLeafTriangles; ++i) {
        const std::uint32_t prim = leaf.prim_id[i];
        const std::uint32_t corners = leaf.vertex[i].corners;
        const Float4 p = load4(&leaf.vertex[corner(corners, 0)].x);
        const Float4 q = load4(&leaf.vertex[corner(corners, 1)].x);
        const Float4 r = load4(&leaf.vertex[corner(corners, 2)].x);
        alignas(16) float least[4], most[4];
        store(min(p, min(q, r)), least);
        store(max(p, max(q, r)), most);
        for (int axis = 0; axis < 3; ++axis) {
            out.lower[axis][i] = least[axis];
            out.upper[axis][i] = most[axis];
        }
        if (prim == kNoPrim || !(most[0] <= kSceneExtent)) continue;
        const std::uint8_t sets = sets_of(scene, prim);
        out.in_first |= (sets & kInFirstSet) != 0 ? 1u << i : 0;
        out.in_second |= (sets & kInSecondSet) != 0 ? 1u << i : 0;
    }
    out.used = out.in_first | out.in_second;
}

// Triangles that meet in the space of CrossingScene may be this far apart in scene space.
inline constexpr float kSpaceRounding = 0x1p-39f;

/// A box with room for what is rounded.
HWY_INLINE Box widened(Box box) {
    for (int axis = 0; axis < 3; ++axis) {
        box.lower[axis] -= kSpaceRounding;
        box.upper[axis] += kSpaceRounding;
    }
    return box;
}
HWY_INLINE Box box_of(const LeafTriangles& triangles, std::uint32_t slot) {
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
        box.lower[axis] = triangles.lower[axis][slot];
        box.upper[axis] = triangles.upper[axis][slot];
    }
    return box;
}

/// The slots of 16 boxes that meet a box.
template <class Planes>
HWY_INLINE std::uint32_t slots_meeting(const Box& box, Planes planes) {
    return bits_of_sixteen([&](std::size_t slot) HWY_ATTR {
        Mask meets = (planes(0, 0, slot) <= splat(box.upper.x)) &
                     (planes(0, 1, slot) >= splat(box.lower.x));
        meets = meets & (planes(1, 0, slot) <= splat(box.upper.y)) &
                (planes(1, 1, slot) >= splat(box.lower.y));
        return meets & (planes(2, 0, slot) <= splat(box.upper.z)) &
               (planes(2, 1, slot) >= splat(box.lower.z));
    });
}
HWY_INLINE std::uint32_t slots_meeting(const Box& box, const LeafTriangles& triangles) {
    return slots_meeting(box, [&](int axis, int side, std::size_t slot) HWY_ATTR {
        return load((side == 0 ? triangles.lower : triangles.upper)[axis] + slot);
    });
}

/// Adds the pairs of triangles of two leaves whose boxes meet; of one leaf each pair once.
HWY_INLINE void add_pairs(const Leaf& leaf, const LeafTriangles& own, const Leaf& other_leaf,
                          const LeafTriangles& other, const Box& other_box, PairTests& tests) {
    std::uint32_t left = own.used & slots_meeting(widened(other_box), own);
    for (; left != 0; left &= left - 1) {
        const auto i = static_cast<std::uint32_t>(std::countr_zero(left));
        std::uint32_t partners = 0;
        if ((own.in_first >> i & 1) != 0) partners |= other.in_second;
        if ((own.in_second >> i & 1) != 0) partners |= other.in_first;
        if (&own == &other) partners &= ~((2u << i) - 1);
        if (partners == 0) continue;
        partners &= slots_meeting(widened(box_of(own, i)), other);
        for (; partners != 0; partners &= partners - 1)
            tests.add(leaf.prim_id[i], other_leaf.prim_id[std::countr_zero(partners)]);
    }
}

void find_crossings_of_leaf(const CrossingScene& scene, std::uint32_t index,
                            std::vector<TrianglePair>& found) {
    const Bvh& bvh = scene.bvh;
    const Leaf& leaf = bvh.leaves[index];
    LeafTriangles own;
    load_triangles(scene, leaf, own);
    if (own.used == 0) return;
    Box bounds;
    for (std::uint32_t left = own.used; left != 0; left &= left - 1)
        bounds.extend(box_of(own, static_cast<std::uint32_t>(std::countr_zero(left))));
    const Box reach = widened(bounds);
    PairTests tests(scene, found);
    TraversalStack<std::uint32_t> stack;
    std::size_t top = 0;
    stack[top++] = 0;
    while (top != 0) {
        const Node& node = bvh.nodes[stack[--top]];
        std::uint32_t met =
            slots_meeting(reach, [&](int axis, int side, std::size_t slot) HWY_ATTR {
                return planes_of(node, static_cast<std::uint32_t>(axis),
                                 static_cast<std::uint32_t>(side), slot);
            });
        for (; met != 0; met &= met - 1) {
            const auto slot = static_cast<std::uint32_t>(std::countr_zero(met));
            const std::uint32_t child = child_of(node, slot);
            if (!is_leaf(child)) {
                stack[top++] = child;
            } else if (child == kEmptyChild || leaf_of(child) < index) {
                continue;
            } else if (leaf_of(child) == index) {
                add_pairs(leaf, own, leaf, own, bounds, tests);
            } else {
                LeafTriangles other;
                const Leaf& other_leaf = bvh.leaves[leaf_of(child)];
                load_triangles(scene, other_leaf, other);
                if (other.used != 0)
                    add_pairs(leaf, own, other_leaf, other, slot_box(node, slot), tests);
            }
        }
    }
    tests.finish();
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {

HWY_EXPORT(find_crossings_of_leaf);

FindCrossings find_crossings(const SimdTarget& target) {
    return SIMD_FUNCTION(find_crossings_of_leaf, target);
}

}  // namespace mray::cpu

#endif  // HWY_ONCE
