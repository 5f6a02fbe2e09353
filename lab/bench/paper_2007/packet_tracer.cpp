// Based on: I. Wald, S. Boulos, P. Shirley. Ray tracing deformable scenes using dynamic bounding
// volume hierarchies. ACM Transactions on Graphics 26(1). 2007.
//
// The paper's traversal as it stands there, with vectors of 16 where it had 4. Changed: triangles
// are intersected by the planes through the common origin and their edges, set up once a packet.
// Its rounding is its own, so hits differ from ours as rarely as Embree's.
#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>

#include "common/bvh/builder/binary_tree.h"
#include "lab/bench/paper_2007/packet.h"
#include "lab/bench/peer_tree.h"

namespace mray::bench::paper_2007 {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

using glm::cross;
using glm::dot;

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
    PaperTracer(const PeerTree& tree, const TraceWork& work)
        : tree_(tree), work_(work), packets_(make_packets(work)), answers_(packets_.size()) {}

    void trace(const WorkPart& part) {
        tbb::parallel_for(part.begin, part.end, [&](std::size_t tile) {
            for (std::size_t i = tile * kTilePackets; i < (tile + 1) * kTilePackets; ++i) {
                if (!packets_[i].any) continue;
                if (work_.any_hit()) {
                    Traversal<true>(tree_, packets_[i], answers_[i]).run();
                } else {
                    Traversal<false>(tree_, packets_[i], answers_[i]).run();
                }
            }
        });
    }

    TraceAnswers answers() const {
        TraceAnswers answers(work_);
        for (Hit& hit : answers.hits) hit = no_hit();
        for (std::size_t ray = 0; ray < work_.rays.size(); ++ray) {
            if (work_.active[ray] == 0) continue;
            const PacketAnswers& a = answers_[ray / kPacketRays];
            const std::size_t g = ray % kPacketRays / kLanes;
            const std::size_t lane = ray % kLanes;
            if (work_.any_hit()) {
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
    const TraceWork& work_;
    std::vector<PacketRays> packets_;
    std::vector<PacketAnswers> answers_;
};

}  // namespace
}  // namespace mray::bench::paper_2007

mray::bench::Tracer mray::bench::paper_tracer(const PeerTree& tree, const TraceWork& work) {
    const auto tracer = std::make_shared<paper_2007::PaperTracer>(tree, work);
    return {.name = "paper-2007",
            .group = "paper-2007",
            .trace = [tracer](const WorkPart& part) { tracer->trace(part); },
            .answers = [tracer] { return tracer->answers(); }};
}
