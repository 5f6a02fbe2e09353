#include "cpu/queries/crossing_pairs.h"

#include <algorithm>
#include <array>
#include <utility>

#include "common/scene/triangle_crossing.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/queries/crossing_pairs.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/simd/node-inl.h"
#include "cpu/simd/triangle_plane-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// ---- Planes that separate two triangles, in lanes of doubles

using DoubleMask = hn::Mask<DoubleTag>;
inline constexpr std::size_t kPairLanes = hn::MaxLanes(kDoubles);

HWY_INLINE Double3 operator*(const Double3& a, DoubleVec b) { return {a.x * b, a.y * b, a.z * b}; }
HWY_INLINE Double3 largest(const Double3& a, const Double3& b) {
    return {hn::Max(a.x, b.x), hn::Max(a.y, b.y), hn::Max(a.z, b.z)};
}
/// Of a length between 0.96 and 1.04, which is enough for normals, without a root or division. Half
/// of the bits of a number, from those of a constant, are about its reciprocal root.
HWY_INLINE Double3 about_unit(const Double3& v) {
    const hn::RebindToUnsigned<DoubleTag> bits;
    const auto half = hn::ShiftRight<1>(hn::BitCast(bits, dot(v, v)));
    const auto root = hn::Sub(hn::Set(bits, std::uint64_t{0x5FE6EB50C7B537A9}), half);
    return v * hn::BitCast(kDoubles, root);
}

// The normals of planes may be rounded: only that corners are surely above or below them counts.

/// Whether a normal surely has the differences on this side.
HWY_INLINE DoubleMask surely_above(const Double3& normal, const Double3& v) {
    return dot(normal, v) > real(kPlaneRounding) * dot(magnitudes(normal), magnitudes(v));
}

/// Pairs of triangles without a common vertex.
HWY_INLINE DoubleMask are_separate(const Double3 a[3], const Double3 b[3]) {
    const Double3 edge = a[1] - a[0];
    const Double3 edge2 = a[2] - a[0];
    const Double3 from_a[] = {b[0] - a[0], b[1] - a[0], b[2] - a[0]};
    Double3 most = largest(magnitudes(edge), magnitudes(edge2));
    for (const Double3& v : from_a) most = largest(most, magnitudes(v));
    const DoubleVec none = hn::Zero(kDoubles);
    const auto separates = [&](const Double3& normal) HWY_ATTR {
        const DoubleVec p = dot(normal, edge), q = dot(normal, edge2);
        DoubleVec d[3];
        for (int i = 0; i < 3; ++i) d[i] = dot(normal, from_a[i]);
        // Two of them are compared, which rounds once more.
        const DoubleVec error = real(4 * kPlaneRounding) * dot(magnitudes(normal), most);
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
        const DoubleVec by = hn::Max(real(2) * slope, real(0x1p-20));
        return own - normal * hn::CopySign(by, to_first);
    };
    try_normal(turned(about_unit(cross(p, q)), p1 + q1, r, s));
    try_normal(turned(about_unit(cross(r, s)), r1 + s1, p, q) * real(-1));
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
        const Double3 e = magnitudes(edge), w = magnitudes(v);
        const Double3 products = {w.y * e.z + w.z * e.y, w.z * e.x + w.x * e.z,
                                  w.x * e.y + w.y * e.x};
        return real(kSideRounding) * dot(magnitudes(along), products);
    };
    return hn::And(dot(along, across_c) > error(c), dot(along, across_d) < hn::Neg(error(d)));
}

// ---- Pairs

/// The vertices of two triangles, three each, and their prim_ids.
using Pair = std::array<std::uint32_t, 8>;

/// Pairs that wait for a vector of their kind.
struct PairQueue {
    static constexpr std::size_t kRoom = 4 * kMaxLanes;

    std::size_t count = 0;
    std::uint32_t words[8][kRoom] = {};

    HWY_INLINE Pair operator[](std::size_t i) const {
        Pair pair;
        for (std::size_t k = 0; k < pair.size(); ++k) pair[k] = words[k][i];
        return pair;
    }
    HWY_INLINE void push(const Pair& pair) {
        for (std::size_t k = 0; k < pair.size(); ++k) words[k][count] = pair[k];
        ++count;
    }
};

/// The corners of as many pairs as lanes, which have these vertices.
HWY_INLINE Double3 corners_from(std::span<const vec3> positions, const std::uint32_t* vertices) {
    const hn::Rebind<std::int32_t, DoubleTag> ints;
    const auto vertex = hn::LoadU(ints, reinterpret_cast<const std::int32_t*>(vertices));
    const auto place = vertex + vertex + vertex;
    const auto along = [&](int axis) HWY_ATTR {
        return hn::PromoteTo(kDoubles,
                             hn::GatherIndex(kHalves, &positions.front().x + axis, place));
    };
    return {along(0), along(1), along(2)};
}

/// Tests pairs in vectors, sorted by the number of vertices that they share.
class PairTests {
public:
    PairTests(const CrossingScene& scene, std::vector<TrianglePair>& found)
        : scene_(scene), found_(found) {}

    HWY_INLINE void add(std::uint32_t first, std::uint32_t second) {
        const uvec3 a = scene_.topology.triangles[first], b = scene_.topology.triangles[second];
        unsorted_.push({a.x, a.y, a.z, b.x, b.y, b.z, first, second});
        if (unsorted_.count == kLanes) sort();
    }
    void finish() {
        if (unsorted_.count != 0) sort();
        // Pairs with fewer shared corners may come back with more.
        for (std::size_t shared = 0; shared < 3; ++shared)
            while (sorted_[shared].count != 0) test(shared);
    }

private:
    /// Moves a vector of pairs to the queues of those that share as many vertices, which come
    /// first. A triangle that has a vertex twice is taken as one that shares none.
    HWY_NOINLINE void sort() {
        UintVec v[2][3];
        for (std::size_t i = 0; i < 6; ++i) v[i / 3][i % 3] = load_unaligned(unsorted_.words[i]);
        UintVec counts[2];
        for (std::size_t side = 0; side < 2; ++side) {
            const auto& own = v[side];
            const auto& other = v[1 - side];
            UintMask is_shared[3];
            counts[side] = splat(0u);
            for (std::size_t i = 0; i < 3; ++i) {
                is_shared[i] = (own[i] == other[0]) | (own[i] == other[1]) | (own[i] == other[2]);
                counts[side] = counts[side] + zero_unless(is_shared[i], splat(1u));
            }
            const UintMask second_first = hn::AndNot(is_shared[0], is_shared[1]);
            const UintMask third_first = hn::AndNot(is_shared[1], is_shared[2]);
            for (std::size_t i = 0; i < 3; ++i) {
                const UintVec turned = select(third_first, own[(i + 2) % 3],
                                              select(second_first, own[(i + 1) % 3], own[i]));
                store_unaligned(turned, unsorted_.words[3 * side + i]);
            }
        }
        const UintMask is_sound = hn::And(counts[0] == counts[1], counts[0] < splat(3u));
        std::uint32_t shared_of[kMaxLanes];
        store_unaligned(zero_unless(is_sound, counts[0]), shared_of);
        for (std::size_t l = 0; l < unsorted_.count; ++l) sorted_[shared_of[l]].push(unsorted_[l]);
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
            a[i] = corners_from(scene_.positions, queue.words[i] + queue.count);
            b[i] = corners_from(scene_.positions, queue.words[3 + i] + queue.count);
        }
        const DoubleMask apart = shared == 0   ? are_separate(a, b)
                                 : shared == 1 ? meet_in_vertex(a, b)
                                               : meet_in_edge(a, b);
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(kDoubles, apart, bits);
        Pair left[kPairLanes];
        std::size_t count = 0;
        for (std::size_t i = 0; i < size; ++i)
            if ((bits[0] >> i & 1) == 0) left[count++] = queue[queue.count + i];
        for (std::size_t i = 0; i < count; ++i) decide(left[i], shared);
    }

    /// Decides on a pair of which planes leave open whether it crosses. If more corners lie at one
    /// place than were known to be shared, planes are tried again.
    void decide(Pair pair, std::size_t shared) {
        const auto at = [&](std::size_t i) { return scene_.positions[pair[i]]; };
        std::size_t count = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            std::size_t same = 3 + count;
            while (same < 6 && at(same) != at(i)) ++same;
            if (same == 6) continue;
            std::swap(pair[3 + count], pair[same]);
            std::swap(pair[count++], pair[i]);
        }
        if (count > shared && count < 3) {
            sorted_[count].push(pair);
            if (sorted_[count].count >= kPairLanes) test(count);
        } else if (triangles_cross({at(0), at(1), at(2)}, {at(3), at(4), at(5)})) {
            found_.push_back({std::min(pair[6], pair[7]), std::max(pair[6], pair[7])});
        }
    }

    const CrossingScene& scene_;
    std::vector<TrianglePair>& found_;
    PairQueue unsorted_, sorted_[3];
};

// ---- Leaves

/// The triangles of a leaf as slots of a node: their boxes, and as bits those of each set that may
/// cross others.
struct LeafTriangles {
    Node boxes;
    std::uint32_t in_first = 0, in_second = 0;

    std::uint32_t used() const { return in_first | in_second; }
};

HWY_INLINE void load_triangles(const CrossingScene& scene, const Leaf& leaf, LeafTriangles& out) {
    for (std::uint32_t i = 0; i < kLeafTriangles && leaf.prim_id[i] != kNoPrim; ++i) {
        const std::uint32_t corners = leaf.vertex[i].corners;
        const Float4 p = load4(&leaf.vertex[corner(corners, 0)].x);
        const Float4 q = load4(&leaf.vertex[corner(corners, 1)].x);
        const Float4 r = load4(&leaf.vertex[corner(corners, 2)].x);
        alignas(16) float least[4], most[4];
        store(min(p, min(q, r)), least);
        store(max(p, max(q, r)), most);
        set_slot_box(out.boxes, i, {{least[0], least[1], least[2]}, {most[0], most[1], most[2]}});
        if (!(most[0] <= kSceneExtent)) continue;
        const int sets =
            scene.sets.empty() ? kInFirstSet | kInSecondSet : scene.sets[leaf.prim_id[i]];
        out.in_first |= ((sets & kInFirstSet) != 0 ? 1u : 0u) << i;
        out.in_second |= ((sets & kInSecondSet) != 0 ? 1u : 0u) << i;
    }
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

/// The slots whose boxes meet a box.
HWY_INLINE std::uint32_t slots_meeting(const Box& box, const Node& node) {
    return bits_of_sixteen([&](std::size_t slot) HWY_ATTR {
        Mask meets = (planes_of(node, 0, 0, slot) <= box.upper.x) &
                     (planes_of(node, 0, 1, slot) >= box.lower.x);
        meets = meets & (planes_of(node, 1, 0, slot) <= box.upper.y) &
                (planes_of(node, 1, 1, slot) >= box.lower.y);
        return meets & (planes_of(node, 2, 0, slot) <= box.upper.z) &
               (planes_of(node, 2, 1, slot) >= box.lower.z);
    });
}

/// Adds the pairs of these triangles of a leaf and those of another one whose boxes meet; of one
/// leaf each pair once.
HWY_INLINE void add_pairs(const Leaf& leaf, const LeafTriangles& own, std::uint32_t left,
                          const Leaf& other_leaf, const LeafTriangles& other, PairTests& tests) {
    for (const std::uint32_t i : BitsOf(left)) {
        std::uint32_t partners = 0;
        if ((own.in_first >> i & 1) != 0) partners |= other.in_second;
        if ((own.in_second >> i & 1) != 0) partners |= other.in_first;
        if (&own == &other) partners &= ~((2u << i) - 1);
        if (partners == 0) continue;
        partners &= slots_meeting(widened(slot_box(own.boxes, i)), other.boxes);
        for (const std::uint32_t k : BitsOf(partners))
            tests.add(leaf.prim_id[i], other_leaf.prim_id[k]);
    }
}

void find_crossings_of_leaf(const CrossingScene& scene, std::uint32_t index,
                            std::vector<TrianglePair>& found) {
    const Bvh& bvh = scene.bvh;
    const Leaf& leaf = bvh.leaves[index];
    LeafTriangles own;
    load_triangles(scene, leaf, own);
    if (own.used() == 0) return;
    Box bounds;
    for (const std::uint32_t i : BitsOf(own.used())) bounds.extend(slot_box(own.boxes, i));
    const Box reach = widened(bounds);
    PairTests tests(scene, found);
    TraversalStack<std::uint32_t> stack;
    std::size_t top = 0;
    stack[top++] = 0;
    while (top != 0) {
        const Node& node = bvh.nodes[stack[--top]];
        for (const std::uint32_t slot : BitsOf(slots_meeting(reach, node))) {
            const std::uint32_t child = child_of(node, slot);
            if (!is_leaf(child)) {
                stack[top++] = child;
            } else if (child == kEmptyChild || leaf_of(child) < index) {
                continue;
            } else if (leaf_of(child) == index) {
                add_pairs(leaf, own, own.used(), leaf, own, tests);
            } else if (const std::uint32_t near =
                           own.used() & slots_meeting(widened(slot_box(node, slot)), own.boxes);
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
