#include "cpu/queries/crossing_pairs.h"

#include <algorithm>
#include <array>
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
HWY_INLINE DoubleVec splat_double(double x) { return hn::Set(kDoubles, x); }
/// Of a length between 0.96 and 1.04, which is enough for normals, without a root or division. Half
/// of the bits of a number, from those of a constant, are about its reciprocal root.
HWY_INLINE Double3 about_unit(const Double3& v) {
    const hn::RebindToUnsigned<DoubleTag> bits;
    const auto half = hn::ShiftRight<1>(hn::BitCast(bits, dot(v, v)));
    const auto root = hn::Sub(hn::Set(bits, std::uint64_t{0x5FE6EB50C7B537A9}), half);
    return v * hn::BitCast(kDoubles, root);
}

/// Pairs that wait for a vector of their kind, with the vertices of both triangles.
struct PairQueue {
    static constexpr std::size_t kRoom = 4 * kMaxLanes;

    std::size_t count = 0;
    std::uint32_t prims[2][kRoom], vertices[2][3][kRoom] = {};

    HWY_INLINE TrianglePair pair(std::size_t i) const { return {prims[0][i], prims[1][i]}; }
};

/// The corners of as many pairs as lanes, which have these vertices.
HWY_INLINE Double3 corners_from(std::span<const vec3> positions, const std::uint32_t* vertices) {
    const hn::Rebind<float, DoubleTag> floats;
    const hn::Rebind<std::int32_t, DoubleTag> ints;
    const auto vertex = hn::LoadU(ints, reinterpret_cast<const std::int32_t*>(vertices));
    const auto place = vertex + vertex + vertex;
    const auto along = [&](int axis) HWY_ATTR {
        return hn::PromoteTo(kDoubles, hn::GatherIndex(floats, &positions.front().x + axis, place));
    };
    return {along(0), along(1), along(2)};
}

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
        const DoubleVec error = splat_double(4 * kPlaneRounding) * dot(sizes(normal), most);
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
    const Double3 p1 = about_unit(p), q1 = about_unit(q), r1 = about_unit(r), s1 = about_unit(s);
    DoubleMask found = separates(p1 + q1 - r1 - s1);
    const auto try_normal = [&](const Double3& normal) HWY_ATTR {
        if (!hn::AllTrue(kDoubles, found)) found = hn::Or(found, separates(normal));
    };
    try_normal(about_unit(p1 + q1) - about_unit(r1 + s1));
    // The plane of one triangle, turned about the vertex so that this triangle is above it, if the
    // other one, which is on one side, leaves room.
    const auto turned = [&](const Double3& normal, const Double3& own, const Double3& first,
                            const Double3& second) HWY_ATTR {
        const DoubleVec to_first = dot(normal, first), to_second = dot(normal, second);
        const DoubleVec slope =
            hn::Max(dot(own, first) / hn::Abs(to_first), dot(own, second) / hn::Abs(to_second));
        const DoubleVec by = hn::Max(splat_double(2) * slope, splat_double(0x1p-20));
        return own - normal * hn::CopySign(by, to_first);
    };
    try_normal(turned(about_unit(cross(p, q)), p1 + q1, r, s));
    try_normal(turned(about_unit(cross(r, s)), r1 + s1, p, q) * splat_double(-1));
    for (const Double3& own : {p1, q1})
        for (const Double3& others : {r1, s1}) try_normal(own - others);
    return found;
}

/// Pairs with a common edge: planes through it with the third corners on both sides. As normals
/// across the edge cannot be exact, the sides are those of triple products with it.
HWY_INLINE DoubleMask meet_in_edge(const Double3 a[3], const Double3 b[3]) {
    const Double3 edge = a[1] - a[0], c = a[2] - a[0], d = b[2] - a[0];
    const Double3 across_c = cross(c, edge), across_d = cross(d, edge);
    const Double3 along = about_unit(across_c) - about_unit(across_d);
    const auto error = [&](const Double3& v) HWY_ATTR {
        const Double3 e = sizes(edge), w = sizes(v);
        const Double3 products = {w.y * e.z + w.z * e.y, w.z * e.x + w.x * e.z,
                                  w.x * e.y + w.y * e.x};
        return splat_double(kSideRounding) * dot(sizes(along), products);
    };
    return hn::And(dot(along, across_c) > error(c), dot(along, across_d) < hn::Neg(error(d)));
}

// ---- Triangles and leaves

HWY_INLINE TrianglePair in_order(std::uint32_t a, std::uint32_t b) {
    return {std::min(a, b), std::max(a, b)};
}

/// Tests pairs in vectors, sorted by the number of vertices that they share.
class PairTests {
public:
    PairTests(const CrossingScene& scene, std::vector<TrianglePair>& found)
        : scene_(scene), found_(found) {}

    HWY_INLINE void add(const TrianglePair& pair) {
        put(pair, {0, 1, 2}, {0, 1, 2}, unsorted_);
        if (unsorted_.count == kLanes) sort();
    }
    void finish() {
        if (unsorted_.count != 0) sort();
        // Pairs with fewer shared corners may come back with more.
        for (std::size_t shared = 0; shared < 3; ++shared)
            while (sorted_[shared].count != 0) test(shared);
    }

private:
    /// Corners of a triangle, those that the other one has, too, before the others.
    using Order = std::array<int, 3>;

    HWY_INLINE void put(const TrianglePair& pair, const Order& a, const Order& b,
                        PairQueue& queue) const {
        const uvec3 first = scene_.topology.triangles[pair.first];
        const uvec3 second = scene_.topology.triangles[pair.second];
        const std::size_t at = queue.count++;
        queue.prims[0][at] = pair.first;
        queue.prims[1][at] = pair.second;
        for (std::size_t i = 0; i < 3; ++i) {
            queue.vertices[0][i][at] = first[a[i]];
            queue.vertices[1][i][at] = second[b[i]];
        }
    }

    /// Moves a vector of pairs to the queues of those that share as many vertices, which come
    /// first. A triangle that has a vertex twice is taken as one that shares none.
    HWY_NOINLINE void sort() {
        UintVec v[2][3];
        for (std::size_t side = 0; side < 2; ++side)
            for (std::size_t i = 0; i < 3; ++i)
                v[side][i] = load_unaligned(unsorted_.vertices[side][i]);
        UintMask is_shared[2][3];
        for (std::size_t i = 0; i < 3; ++i) {
            is_shared[0][i] = (v[0][i] == v[1][0]) | (v[0][i] == v[1][1]) | (v[0][i] == v[1][2]);
            is_shared[1][i] = (v[1][i] == v[0][0]) | (v[1][i] == v[0][1]) | (v[1][i] == v[0][2]);
        }
        UintVec counts[2];
        for (std::size_t side = 0; side < 2; ++side) {
            const auto& own = is_shared[side];
            counts[side] = splat(0u);
            for (const UintMask& one : own)
                counts[side] = counts[side] + hn::IfThenElseZero(one, splat(1u));
            const UintMask second_first = hn::AndNot(own[0], own[1]);
            const UintMask third_first = hn::AndNot(own[1], own[2]);
            for (std::size_t i = 0; i < 3; ++i) {
                const UintVec turned =
                    select(third_first, v[side][(i + 2) % 3],
                           select(second_first, v[side][(i + 1) % 3], v[side][i]));
                store_unaligned(turned, unsorted_.vertices[side][i]);
            }
        }
        const UintMask is_sound = hn::And(counts[0] == counts[1], counts[0] < splat(3u));
        std::uint32_t shared_of[kMaxLanes];
        store_unaligned(hn::IfThenElseZero(is_sound, counts[0]), shared_of);
        for (std::size_t l = 0; l < unsorted_.count; ++l) {
            PairQueue& queue = sorted_[shared_of[l]];
            const std::size_t at = queue.count++;
            for (std::size_t side = 0; side < 2; ++side) {
                queue.prims[side][at] = unsorted_.prims[side][l];
                for (std::size_t i = 0; i < 3; ++i)
                    queue.vertices[side][i][at] = unsorted_.vertices[side][i][l];
            }
        }
        unsorted_.count = 0;
        for (std::size_t shared = 0; shared < 3; ++shared)
            while (sorted_[shared].count >= kPairLanes) test(shared);
    }

    /// Tests the last pairs of a queue.
    HWY_NOINLINE void test(std::size_t shared) {
        PairQueue& queue = sorted_[shared];
        const std::size_t size = std::min(queue.count, kPairLanes);
        queue.count -= size;
        Double3 a[3], b[3];
        for (std::size_t i = 0; i < 3; ++i) {
            a[i] = corners_from(scene_.positions, queue.vertices[0][i] + queue.count);
            b[i] = corners_from(scene_.positions, queue.vertices[1][i] + queue.count);
        }
        const DoubleMask apart = shared == 0   ? are_separate(a, b)
                                 : shared == 1 ? meet_in_vertex(a, b)
                                               : meet_in_edge(a, b);
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(kDoubles, apart, bits);
        TrianglePair left[kPairLanes];
        std::size_t count = 0;
        for (std::size_t i = 0; i < size; ++i)
            if ((bits[0] >> i & 1) == 0) left[count++] = queue.pair(queue.count + i);
        for (std::size_t i = 0; i < count; ++i) decide(left[i], shared);
    }

    /// Decides on a pair of which planes leave open whether it crosses. If more corners lie at one
    /// place than were known to be shared, planes are tried again.
    void decide(const TrianglePair& pair, std::size_t shared) {
        const std::array<vec3, 3> a = corners_of(pair.first);
        const std::array<vec3, 3> b = corners_of(pair.second);
        Order of_a = {0, 1, 2}, of_b = {0, 1, 2};
        std::size_t count = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = count; j < 3; ++j) {
                const auto corner_a = static_cast<std::size_t>(of_a[i]);
                const auto corner_b = static_cast<std::size_t>(of_b[j]);
                if (a[corner_a] != b[corner_b]) continue;
                std::swap(of_a[count], of_a[i]);
                std::swap(of_b[count++], of_b[j]);
                break;
            }
        }
        if (count > shared && count < 3) {
            put(pair, of_a, of_b, sorted_[count]);
            if (sorted_[count].count >= kPairLanes) test(count);
        } else if (triangles_cross(a, b)) {
            found_.push_back(pair);
        }
    }
    std::array<vec3, 3> corners_of(std::uint32_t prim) const {
        const uvec3 t = scene_.topology.triangles[prim];
        return {scene_.positions[t.x], scene_.positions[t.y], scene_.positions[t.z]};
    }

    const CrossingScene& scene_;
    std::vector<TrianglePair>& found_;
    PairQueue unsorted_, sorted_[3];
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
        if (prim == kNoPrim) break;
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
        if (!(most[0] <= kSceneExtent)) continue;
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
        Mask meets =
            (planes(0, 0, slot) <= splat(box.upper.x)) & (planes(0, 1, slot) >= splat(box.lower.x));
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

/// Adds the pairs of these triangles of a leaf and those of another one whose boxes meet; of one
/// leaf each pair once.
HWY_INLINE void add_pairs(const Leaf& leaf, const LeafTriangles& own, std::uint32_t left,
                          const Leaf& other_leaf, const LeafTriangles& other, PairTests& tests) {
    for (; left != 0; left &= left - 1) {
        const auto i = static_cast<std::uint32_t>(std::countr_zero(left));
        std::uint32_t partners = 0;
        if ((own.in_first >> i & 1) != 0) partners |= other.in_second;
        if ((own.in_second >> i & 1) != 0) partners |= other.in_first;
        if (&own == &other) partners &= ~((2u << i) - 1);
        if (partners == 0) continue;
        partners &= slots_meeting(widened(box_of(own, i)), other);
        for (; partners != 0; partners &= partners - 1)
            tests.add(in_order(leaf.prim_id[i], other_leaf.prim_id[std::countr_zero(partners)]));
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
                add_pairs(leaf, own, own.used, leaf, own, tests);
            } else if (const std::uint32_t near =
                           own.used & slots_meeting(widened(slot_box(node, slot)), own);
                       near != 0) {
                const Leaf& other_leaf = bvh.leaves[leaf_of(child)];
                LeafTriangles other;
                load_triangles(scene, other_leaf, other);
                add_pairs(leaf, own, near, other_leaf, other, tests);
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
