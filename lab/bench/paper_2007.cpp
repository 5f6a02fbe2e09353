#include "lab/bench/paper_2007.h"

#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>

#include "common/bvh/builder/binary_tree.h"

namespace mray::lab {
namespace {

using glm::cross;
using glm::dot;

// Packets of 16 x 16 rays with a common origin, in GNU vector types of sixteen floats.
constexpr int kLanes = 16;
using Floats __attribute__((vector_size(64))) = float;
/// Also masks: all bits of a lane are set, or none.
using Ints __attribute__((vector_size(64))) = std::int32_t;

// Both take b where a is NaN.
#ifdef __AVX512F__
inline Floats min(const Floats& a, const Floats& b) { return _mm512_min_ps(a, b); }
inline Floats max(const Floats& a, const Floats& b) { return _mm512_max_ps(a, b); }
inline bool any(const Ints& mask) {
    const __m512i bits = reinterpret_cast<__m512i>(mask);
    return _mm512_test_epi32_mask(bits, bits) != 0;
}
#else
inline Floats min(const Floats& a, const Floats& b) { return a < b ? a : b; }
inline Floats max(const Floats& a, const Floats& b) { return a > b ? a : b; }
inline bool any(const Ints& mask) {
    std::int32_t bits = 0;
    for (int i = 0; i < kLanes; ++i) bits |= mask[i];
    return bits != 0;
}
#endif

/// Rays that follow each other in a set: 16 x 16 pixels, in groups of 4 x 4.
constexpr int kGroups = 16;
constexpr std::size_t kPacketRays = std::size_t{kGroups} * kLanes;
constexpr std::size_t kTilePackets = std::size_t{kTileSize} * kTileSize / kPacketRays;

struct PacketRays {
    bool any = false;
    vec3 org;
    Floats dir[3][kGroups];
    /// Negative where there is no ray.
    Floats tfar[kGroups];
    /// Directions between which all rays are, if there are such.
    std::array<vec3, 4> corners;
    bool has_corners = false;
};

/// t, u, v and prim_id (-1: none), or for any hit t < 0 where a ray is occluded.
struct PacketAnswers {
    Floats t[kGroups], u[kGroups], v[kGroups];
    Ints prim_id[kGroups];
};

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
        const std::size_t group = i % kPacketRays / kLanes;
        const std::size_t lane = i % kLanes;
        const Ray& ray = set.rays[i];
        for (int axis = 0; axis < 3; ++axis) packet.dir[axis][group][lane] = ray.dir[axis];
        packet.tfar[group][lane] = set.active[i] != 0 ? ray.tfar : -1.0f;
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

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// For rays from one origin: the planes through the edges, positive inside, and the triangle's own.
struct EdgePlanes {
    vec3 n[3];
    vec3 normal;
    float depth;
};

EdgePlanes edge_planes(const PeerTriangle& triangle, vec3 org) {
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
        for (int g = 0; g < kGroups; ++g) {
            answers_.t[g] = rays.tfar[g];
            answers_.u[g] = answers_.v[g] = Floats{};
            answers_.prim_id[g] = Ints{} - 1;
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
            const int first = first_active(node, entry.first);
            if (first == kGroups) continue;
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
        int first;
    };

    void bound_reciprocals(int axis) {
        const Floats infinite = Floats{} + kInfinity;
        Floats lower = infinite;
        Floats upper = -infinite;
        for (int g = 0; g < kGroups; ++g) {
            rcp_[axis][g] = 1.0f / rays_.dir[axis][g];
            const Ints active = rays_.tfar[g] >= 0.0f;
            lower = min(active ? rcp_[axis][g] : infinite, lower);
            upper = max(active ? rcp_[axis][g] : -infinite, upper);
        }
        Interval& r = intervals_[axis];
        for (int i = 0; i < kLanes; ++i) {
            r.lower = std::min(r.lower, lower[i]);
            r.upper = std::max(r.upper, upper[i]);
        }
        const bool bounded = r.lower > -kInfinity && r.upper < kInfinity;
        is_split_[axis] = !bounded || (r.lower < 0 && r.upper > 0);
        is_negative_[axis] = r.upper < 0 || (is_split_[axis] && -r.lower > r.upper);
        any_split_ = any_split_ || is_split_[axis];
    }

    /// The first group of rays, from `first` on, that hits a node; kGroups if none does.
    int first_active(const PeerNode& node, int first) const {
        const vec3 lower = node.lower - rays_.org;
        const vec3 upper = node.upper - rays_.org;
        if (hits_box(lower, upper, first)) return first;
        if (all_miss(lower, upper)) return kGroups;
        for (int g = first + 1; g < kGroups; ++g) {
            if (hits_box(lower, upper, g)) return g;
        }
        return kGroups;
    }

    bool hits_box(vec3 lower, vec3 upper, int g) const {
        Floats tnear{};
        Floats tfar = answers_.t[g];
        for (int axis = 0; axis < 3; ++axis) {
            const Floats& r = rcp_[axis][g];
            const float first = is_negative_[axis] ? upper[axis] : lower[axis];
            const float second = is_negative_[axis] ? lower[axis] : upper[axis];
            const Floats t0 = first * r;
            const Floats t1 = second * r;
            tnear = max(any_split_ ? min(t0, t1) : t0, tnear);
            tfar = min(any_split_ ? max(t0, t1) : t1, tfar);
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
    bool intersect_leaf(const PeerNode& leaf, int first) {
        bool hit = false;
        for (std::uint32_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
            const PeerTriangle& triangle = tree_.triangles[i];
            const EdgePlanes planes = edge_planes(triangle, rays_.org);
            if (!(planes.depth > 0) || all_outside(planes)) continue;
            for (int g = first; g < kGroups; ++g) {
                if (intersect_group(planes, triangle.prim_id, g)) hit = true;
            }
        }
        return hit;
    }

    bool intersect_group(const EdgePlanes& planes, std::uint32_t prim_id, int g) {
        Floats e[3];
        for (int i = 0; i < 3; ++i) e[i] = dot_group(planes.n[i], g);
        const Ints inside = (e[0] >= 0.0f) & (e[1] >= 0.0f) & (e[2] >= 0.0f);
        if (!any(inside)) return false;
        const Floats t = planes.depth / dot_group(planes.normal, g);
        const Ints nearer = inside & (t > 0.0f) & (t < answers_.t[g]);
        if (!any(nearer)) return false;
        if (kAnyHit) {
            answers_.t[g] = nearer ? Floats{} - 1.0f : answers_.t[g];
            return true;
        }
        const Floats rsum = 1.0f / (e[0] + e[1] + e[2]);
        answers_.t[g] = nearer ? t : answers_.t[g];
        answers_.u[g] = nearer ? e[1] * rsum : answers_.u[g];
        answers_.v[g] = nearer ? e[2] * rsum : answers_.v[g];
        answers_.prim_id[g] =
            nearer ? Ints{} + static_cast<std::int32_t>(prim_id) : answers_.prim_id[g];
        return true;
    }

    Floats dot_group(const vec3& n, int g) const {
        return rays_.dir[0][g] * n.x + rays_.dir[1][g] * n.y + rays_.dir[2][g] * n.z;
    }

    bool all_occluded() const {
        for (int g = 0; g < kGroups; ++g) {
            if (any(answers_.t[g] >= 0.0f)) return false;
        }
        return true;
    }

    const PeerTree& tree_;
    const PacketRays& rays_;
    PacketAnswers& answers_;
    Floats rcp_[3][kGroups];
    std::array<Interval, 3> intervals_;
    /// By axis: whether the rays go to both sides, or along it nowhere; and to which side most go.
    std::array<bool, 3> is_split_;
    std::array<bool, 3> is_negative_;
    bool any_split_ = false;
};

class PaperTracer {
public:
    PaperTracer(const PeerTree& tree, const RaySet& set)
        : tree_(tree), set_(set), packets_(make_packets(set)), answers_(packets_.size()) {}

    void trace(const TileRange& range) {
        tbb::parallel_for(range.begin, range.end, [&](std::size_t tile) {
            for (std::size_t i = tile * kTilePackets; i < (tile + 1) * kTilePackets; ++i) {
                if (!packets_[i].any) continue;
                if (set_.any_hit()) {
                    Traversal<true>(tree_, packets_[i], answers_[i]).run();
                } else {
                    Traversal<false>(tree_, packets_[i], answers_[i]).run();
                }
            }
        });
    }

    TraceAnswers answers() const {
        TraceAnswers answers(set_);
        for (Hit& hit : answers.hits) hit = no_hit();
        for (std::size_t ray = 0; ray < set_.rays.size(); ++ray) {
            if (set_.active[ray] == 0) continue;
            const PacketAnswers& a = answers_[ray / kPacketRays];
            const std::size_t g = ray % kPacketRays / kLanes;
            const std::size_t lane = ray % kLanes;
            if (set_.any_hit()) {
                answers.occluded[ray] = a.t[g][lane] < 0;
            } else if (a.prim_id[g][lane] >= 0) {
                answers.hits[ray] = {a.t[g][lane], a.u[g][lane], a.v[g][lane],
                                     static_cast<std::uint32_t>(a.prim_id[g][lane])};
            }
        }
        return answers;
    }

private:
    const PeerTree& tree_;
    const RaySet& set_;
    std::vector<PacketRays> packets_;
    std::vector<PacketAnswers> answers_;
};

}  // namespace

PeerTree build_paper_tree(const Topology& topology, std::span<const vec3> positions) {
    return build_peer_tree(topology, positions, {2, std::numeric_limits<std::uint32_t>::max()});
}

Tracer paper_tracer(const PeerTree& tree, const RaySet& set) {
    const auto tracer = std::make_shared<PaperTracer>(tree, set);
    return {.name = "paper-2007",
            .group = "paper-2007",
            .trace = [tracer](const TileRange& range) { tracer->trace(range); },
            .answers = [tracer] { return tracer->answers(); }};
}

}  // namespace mray::lab
