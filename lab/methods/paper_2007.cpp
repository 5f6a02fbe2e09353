#include "lab/methods/paper_2007.h"

#include <cassert>
#include <cmath>
#include <glm/geometric.hpp>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lab/methods/paper_2007.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/bvh/builder/binary_tree.h"
#include "common/simd/vectors-inl.h"

#ifndef MORPHRAY_LAB_METHODS_PAPER_PACKETS
#define MORPHRAY_LAB_METHODS_PAPER_PACKETS

namespace mray::lab {

// Packets of 16 x 16 rays with a common origin, in the order of a set: blocks of 4 x 4.
constexpr std::size_t kPacketRays = 256;
constexpr std::size_t kTilePackets = std::size_t{kTileSize} * kTileSize / kPacketRays;

struct alignas(64) PacketRays {
    float dir[3][kPacketRays];
    /// Negative where there is no ray.
    float tfar[kPacketRays];
    vec3 org;
    /// Directions between which all rays are, if there are such.
    std::array<vec3, 4> corners;
    bool has_corners = false;
    bool any = false;
};

/// t, u, v and prim_id, or for any hit t < 0 where a ray is occluded.
struct alignas(64) PacketAnswers {
    float t[kPacketRays], u[kPacketRays], v[kPacketRays];
    std::uint32_t prim_id[kPacketRays];
};

}  // namespace mray::lab

#endif  // MORPHRAY_LAB_METHODS_PAPER_PACKETS

HWY_BEFORE_NAMESPACE();
namespace mray::lab {
namespace HWY_NAMESPACE {

using glm::cross;
using glm::dot;

using namespace simd::HWY_NAMESPACE;

// Both return b where a is NaN.
HWY_INLINE FloatVec second_min(FloatVec a, FloatVec b) {
    return HWY_ARCH_X86 ? min(a, b) : select(a < b, a, b);
}
HWY_INLINE FloatVec second_max(FloatVec a, FloatVec b) {
    return HWY_ARCH_X86 ? max(a, b) : select(a > b, a, b);
}
HWY_INLINE bool any(Mask m) { return !hn::AllFalse(kFloats, m); }

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// For rays from one origin: the planes through the edges, positive inside, and the triangle's own.
struct EdgePlanes {
    vec3 n[3];
    vec3 normal;
    float depth;
};

HWY_INLINE EdgePlanes edge_planes(const PeerTriangle& triangle, vec3 org) {
    const vec3 a = triangle.a - org;
    const vec3 b = triangle.b - org;
    const vec3 c = triangle.c - org;
    // Differences times sums lose less than products of the vertices, of which they are twice.
    EdgePlanes planes = {
        {cross(b - c, b + c), cross(c - a, c + a), cross(a - b, a + b)}, cross(b - a, c - a), 0};
    planes.depth = dot(a, planes.normal);
    if (planes.depth < 0) {
        for (vec3& n : planes.n) n = -n;
        planes.normal = -planes.normal;
        planes.depth = -planes.depth;
    }
    return planes;
}

/// Bounds over all rays of where a packet meets a plane: reciprocals of the directions.
struct Interval {
    float lower = kInfinity;
    float upper = -kInfinity;
};

template <bool kAnyHit>
class Traversal {
public:
    Traversal(const PeerTree& tree, const PacketRays& rays, PacketAnswers& answers)
        : tree_(tree), rays_(rays), answers_(answers) {
        for (std::size_t r = 0; r < kPacketRays; r += kLanes) {
            store(load(rays.tfar + r), answers.t + r);
            store(zero(), answers.u + r);
            store(zero(), answers.v + r);
            store(splat(kNoPrim), answers.prim_id + r);
        }
        for (int axis = 0; axis < 3; ++axis) bound_reciprocals(axis);
    }

    void run() {
        if (tree_.nodes.empty()) return;
        Entry stack[kMaxBinaryHeight + 2];
        int size = 0;
        stack[size++] = {0, 0};
        while (size > 0) {
            const Entry entry = stack[--size];
            const PeerNode& node = tree_.nodes[entry.node];
            const std::size_t first = first_active(node, entry.first);
            if (first == kPacketRays) continue;
            if (node.count != 0) {
                if (intersect_leaf(node, first) && kAnyHit && all_occluded()) return;
                continue;
            }
            const std::uint32_t nearer = is_negative_[node.axis] ? 1 : 0;
            stack[size++] = {node.first + 1 - nearer, first};
            stack[size++] = {node.first + nearer, first};
        }
    }

private:
    struct Entry {
        std::uint32_t node;
        /// Of the rays, a multiple of kLanes.
        std::size_t first;
    };

    void bound_reciprocals(int axis) {
        FloatVec lower = splat(kInfinity);
        FloatVec upper = splat(-kInfinity);
        for (std::size_t i = 0; i < kPacketRays; i += kLanes) {
            const FloatVec reciprocal = splat(1.0f) / load(rays_.dir[axis] + i);
            store(reciprocal, rcp_[axis] + i);
            const Mask active = load(rays_.tfar + i) >= 0.0f;
            lower = min(select(active, reciprocal, kInfinity), lower);
            upper = max(select(active, reciprocal, -kInfinity), upper);
        }
        Interval& r = intervals_[axis];
        r = {hn::GetLane(hn::MinOfLanes(kFloats, lower)),
             hn::GetLane(hn::MaxOfLanes(kFloats, upper))};
        const bool bounded = r.lower > -kInfinity && r.upper < kInfinity;
        is_split_[axis] = !bounded || (r.lower < 0 && r.upper > 0);
        is_negative_[axis] = r.upper < 0 || (is_split_[axis] && -r.lower > r.upper);
        any_split_ = any_split_ || is_split_[axis];
    }

    /// The first vector of rays, from `first` on, that hits a node; kPacketRays if none does.
    std::size_t first_active(const PeerNode& node, std::size_t first) const {
        const vec3 lower = node.lower - rays_.org;
        const vec3 upper = node.upper - rays_.org;
        if (hits_box(lower, upper, first)) return first;
        if (all_miss(lower, upper)) return kPacketRays;
        while ((first += kLanes) < kPacketRays)
            if (hits_box(lower, upper, first)) return first;
        return kPacketRays;
    }

    bool hits_box(vec3 lower, vec3 upper, std::size_t r) const {
        FloatVec tnear = zero();
        FloatVec tfar = load(answers_.t + r);
        for (int axis = 0; axis < 3; ++axis) {
            const FloatVec reciprocal = load(rcp_[axis] + r);
            const float first = is_negative_[axis] ? upper[axis] : lower[axis];
            const float second = is_negative_[axis] ? lower[axis] : upper[axis];
            const FloatVec t0 = first * reciprocal;
            const FloatVec t1 = second * reciprocal;
            tnear = second_max(any_split_ ? second_min(t0, t1) : t0, tnear);
            tfar = second_min(any_split_ ? second_max(t0, t1) : t1, tfar);
        }
        return any(tnear <= tfar);
    }

    /// Interval arithmetic: whether even the earliest entry of any ray is after the latest exit.
    bool all_miss(vec3 lower, vec3 upper) const {
        float tnear = 0;
        float tfar = kInfinity;
        for (int axis = 0; axis < 3; ++axis) {
            if (is_split_[axis]) continue;
            const Interval& r = intervals_[axis];
            const float first = is_negative_[axis] ? upper[axis] : lower[axis];
            const float second = is_negative_[axis] ? lower[axis] : upper[axis];
            tnear = std::max(tnear, std::min(first * r.lower, first * r.upper));
            tfar = std::min(tfar, std::max(second * r.lower, second * r.upper));
        }
        return tnear > tfar;
    }

    bool all_outside(const EdgePlanes& planes) const {
        if (!rays_.has_corners) return false;
        for (const vec3& n : planes.n) {
            bool outside = true;
            for (const vec3& corner : rays_.corners) outside = outside && dot(n, corner) < 0;
            if (outside) return true;
        }
        return false;
    }

    /// Whether a ray hit something nearer.
    bool intersect_leaf(const PeerNode& leaf, std::size_t first) {
        bool hit = false;
        for (std::uint32_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
            const PeerTriangle& triangle = tree_.triangles[i];
            const EdgePlanes planes = edge_planes(triangle, rays_.org);
            if (!(planes.depth > 0) || all_outside(planes)) continue;
            for (std::size_t r = first; r < kPacketRays; r += kLanes)
                if (intersect_vector(planes, triangle.prim_id, r)) hit = true;
        }
        return hit;
    }

    bool intersect_vector(const EdgePlanes& planes, std::uint32_t prim_id, std::size_t r) {
        FloatVec e[3];
        for (int i = 0; i < 3; ++i) e[i] = dot_rays(planes.n[i], r);
        const Mask inside = (e[0] >= 0.0f) & (e[1] >= 0.0f) & (e[2] >= 0.0f);
        if (!any(inside)) return false;
        const FloatVec t = splat(planes.depth) / dot_rays(planes.normal, r);
        const FloatVec before = load(answers_.t + r);
        const Mask nearer = inside & (t > 0.0f) & (t < before);
        if (!any(nearer)) return false;
        if (kAnyHit) {
            store(select(nearer, -1.0f, before), answers_.t + r);
            return true;
        }
        const FloatVec sum = splat(1.0f) / (e[0] + e[1] + e[2]);
        store(select(nearer, t, before), answers_.t + r);
        store(select(nearer, e[1] * sum, load(answers_.u + r)), answers_.u + r);
        store(select(nearer, e[2] * sum, load(answers_.v + r)), answers_.v + r);
        store(select(uint_mask(nearer), splat(prim_id), load(answers_.prim_id + r)),
              answers_.prim_id + r);
        return true;
    }

    FloatVec dot_rays(const vec3& n, std::size_t r) const {
        return load(rays_.dir[0] + r) * n.x + load(rays_.dir[1] + r) * n.y +
               load(rays_.dir[2] + r) * n.z;
    }

    bool all_occluded() const {
        for (std::size_t r = 0; r < kPacketRays; r += kLanes)
            if (any(load(answers_.t + r) >= 0.0f)) return false;
        return true;
    }

    const PeerTree& tree_;
    const PacketRays& rays_;
    PacketAnswers& answers_;
    alignas(64) float rcp_[3][kPacketRays];
    std::array<Interval, 3> intervals_;
    /// By axis: whether the rays go to both sides, or along it nowhere; and to which side most go.
    std::array<bool, 3> is_split_;
    std::array<bool, 3> is_negative_;
    bool any_split_ = false;
};

void trace_packets(const PeerTree& tree, bool any_hit, std::span<const PacketRays> packets,
                   std::span<PacketAnswers> answers) {
    for (std::size_t i = 0; i < packets.size(); ++i) {
        if (!packets[i].any) continue;
        if (any_hit) {
            Traversal<true>(tree, packets[i], answers[i]).run();
        } else {
            Traversal<false>(tree, packets[i], answers[i]).run();
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::lab {
namespace {

HWY_EXPORT(trace_packets);

/// A rectangle around where the rays meet a plane across their main axis; none where one does not.
void bound_by_corners(PacketRays& packet, std::span<const vec3> dirs) {
    vec3 sum = {0, 0, 0};
    for (const vec3& dir : dirs) sum += dir;
    int z = 0;
    for (int axis = 1; axis < 3; ++axis) {
        if (std::fabs(sum[axis]) > std::fabs(sum[z])) z = axis;
    }
    const int x = (z + 1) % 3;
    const int y = (z + 2) % 3;
    const float side = sum[z] < 0 ? -1.0f : 1.0f;
    vec3 lower(INFINITY);
    vec3 upper(-INFINITY);
    for (const vec3& dir : dirs) {
        if (!(dir[z] * side > 0)) return;
        for (const int axis : {x, y}) {
            lower[axis] = std::min(lower[axis], dir[axis] / std::fabs(dir[z]));
            upper[axis] = std::max(upper[axis], dir[axis] / std::fabs(dir[z]));
        }
    }
    for (int i = 0; i < 4; ++i) {
        packet.corners[i][x] = i % 2 == 0 ? lower[x] : upper[x];
        packet.corners[i][y] = i < 2 ? lower[y] : upper[y];
        packet.corners[i][z] = side;
    }
    packet.has_corners = true;
}

/// The packets of primary or shadow rays, kTilePackets for each tile.
std::vector<PacketRays> make_packets(const RaySet& set) {
    assert(set.rays.size() == set.tiles.size() * kTilePackets * kPacketRays);
    std::vector<PacketRays> packets(set.rays.size() / kPacketRays);
    std::vector<vec3> dirs;
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        PacketRays& packet = packets[i / kPacketRays];
        const std::size_t at = i % kPacketRays;
        const Ray& ray = set.rays[i];
        for (int axis = 0; axis < 3; ++axis) packet.dir[axis][at] = ray.dir[axis];
        packet.tfar[at] = set.active[i] != 0 ? ray.tfar : -1.0f;
        if (set.active[i] != 0) {
            packet.org = ray.org;
            dirs.push_back(ray.dir);
        }
        if ((i + 1) % kPacketRays != 0) continue;
        packet.any = !dirs.empty();
        bound_by_corners(packet, dirs);
        dirs.clear();
    }
    return packets;
}

}  // namespace

Tracer paper_tracer(const PeerTree& tree, const RaySet& set) {
    const auto packets = std::make_shared<const std::vector<PacketRays>>(make_packets(set));
    const auto found = std::make_shared<std::vector<PacketAnswers>>(packets->size());
    const auto trace =
        [=, &tree, &set,
         trace_some = SIMD_FUNCTION(trace_packets, best_simd_target())](const TileRange& range) {
            tbb::parallel_for(range.begin, range.end, [&](std::size_t tile) {
                const std::size_t first = tile * kTilePackets;
                trace_some(tree, set.any_hit(), std::span(*packets).subspan(first, kTilePackets),
                           std::span(*found).subspan(first, kTilePackets));
            });
        };
    const auto answers = [found, &set] {
        TraceAnswers all(set);
        for (std::size_t ray = 0; ray < set.rays.size(); ++ray) {
            const PacketAnswers& a = (*found)[ray / kPacketRays];
            const std::size_t at = ray % kPacketRays;
            if (set.any_hit()) {
                all.occluded[ray] = set.active[ray] != 0 && a.t[at] < 0;
            } else if (set.active[ray] != 0 && a.prim_id[at] != kNoPrim) {
                all.hits[ray] = {a.t[at], a.u[at], a.v[at], a.prim_id[at]};
            } else {
                all.hits[ray] = no_hit();
            }
        }
        return all;
    };
    return {.name = "paper-2007", .group = "paper-2007", .trace = trace, .answers = answers};
}

}  // namespace mray::lab

#endif  // HWY_ONCE
