#include "lab/accuracy/referee/exact_referee.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/bvh/box.h"

namespace mray::accuracy {
namespace {

constexpr double kCloseUlps = 4;
// In sizes of a triangle across the ray, and in distances of its corners: twice the displacement of
// vertices by the rule (docs/design/arithmetic.md, "A vertex is one point").
constexpr double kDisplacement = 0x1p-21;
constexpr double kFarDisplacement = 0x1p-43;
// In sizes of a triangle: within it a miss is a leak, a hit at that depth a neighbour's.
constexpr double kNearEdge = 0x1p-12;

// Far above the 2^-53 of a double, far below the resolution of a tracer in float.
constexpr double kRounding = 0x1p-40;

/// Narrows [enter, leave]. A ray parallel to the slab is inside or outside, without a division.
bool meet_slab(double lower, double upper, double org, double dir, double& enter, double& leave) {
    if (dir == 0) return org >= lower && org <= upper;
    double t0 = (lower - org) / dir;
    double t1 = (upper - org) / dir;
    if (t0 > t1) std::swap(t0, t1);
    // Quotients have a relative error of about 2^-52.
    enter = std::max(enter, t0 - std::abs(t0) * kRounding);
    leave = std::min(leave, t1 + std::abs(t1) * kRounding);
    return enter <= leave;
}

bool meets(const Box& box, const Ray& ray, double margin) {
    if (box.empty()) return false;
    double enter = 0;
    double leave = INFINITY;
    for (int axis = 0; axis < 3; ++axis) {
        if (!meet_slab(box.lower[axis] - margin, box.upper[axis] + margin, ray.org[axis],
                       ray.dir[axis], enter, leave)) {
            return false;
        }
    }
    return true;
}

double largest_magnitude(vec3 v) {
    return std::max({std::abs(double{v.x}), std::abs(double{v.y}), std::abs(double{v.z})});
}

double largest_of(const Bvh& bvh) {
    const Box box = node_box(bvh.nodes[0]);
    if (box.empty()) return 0;
    return std::max(largest_magnitude(box.lower), largest_magnitude(box.upper));
}

bool is_usable(vec3 p) {
    const bool invalid =
        p.x == kInvalidCoordinate && p.y == kInvalidCoordinate && p.z == kInvalidCoordinate;
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && !invalid;
}

}  // namespace

std::vector<std::uint32_t> ExactReferee::find_candidates(const Ray& ray, double margin) const {
    std::vector<std::uint32_t> found;
    const double around = margin + rounding_ + kRounding * largest_magnitude(ray.org);
    std::array<std::uint32_t, kMaxStack> stack;
    std::size_t size = 0;
    stack[size++] = 0;
    while (size != 0) {
        const std::uint32_t child = stack[--size];
        if ((child & kLeafBit) != 0) {
            for (const std::uint32_t prim_id : bvh_->leaves[child & ~kLeafBit].prim_id) {
                if (prim_id != kNoPrim) found.push_back(prim_id);
            }
            continue;
        }
        const Node& node = bvh_->nodes[child];
        for (std::uint32_t slot = 0; slot < kWidth && node.child[slot] != kEmptyChild; ++slot) {
            if (meets(slot_box(node, slot), ray, around)) stack[size++] = node.child[slot];
        }
    }
    return found;
}

double ulp_of(double t) {
    const auto x = static_cast<float>(std::abs(t));
    return static_cast<double>(std::nextafter(x, INFINITY)) - x;
}

bool is_wrong(Verdict verdict) { return verdict > Verdict::kBeside; }

ExactReferee::ExactReferee(const Topology& topology, std::span<const vec3> positions,
                           const Bvh& bvh)
    : topology_(&topology),
      positions_(positions),
      bvh_(&bvh),
      rounding_(kRounding * largest_of(bvh)) {
    for (const uvec3& t : topology.triangles) {
        const vec3 a = positions[t.x];
        const vec3 b = positions[t.y];
        const vec3 c = positions[t.z];
        usable_.push_back(is_usable(a) && is_usable(b) && is_usable(c) && a != b && b != c &&
                          c != a);
    }
}

ExactTriangle ExactReferee::triangle(const Ray& ray, std::uint32_t prim_id) const {
    const uvec3 t = topology_->triangles[prim_id];
    return {ray, positions_[t.x], positions_[t.y], positions_[t.z]};
}

Truth ExactReferee::closest_of(const Ray& ray, std::span<const std::uint32_t> candidates) const {
    if (ray.dir == vec3(0, 0, 0)) return {};
    Truth truth;
    std::optional<ExactTriangle> best;
    for (const std::uint32_t prim_id : candidates) {
        if (usable_[prim_id] == 0) continue;
        ExactTriangle next = triangle(ray, prim_id);
        if (!next.is_met() || !next.in_range()) continue;
        const int order = best ? next.compare_t(*best) : -1;
        if (order > 0 || (order == 0 && prim_id > truth.prim_id)) continue;
        best = std::move(next);
        truth.prim_id = prim_id;
    }
    if (best) truth.t = best->t();
    return truth;
}

Truth ExactReferee::closest(const Ray& ray) const {
    return closest_of(ray, find_candidates(ray, 0));
}

// Shifting the line displaces all vertices equally, so that a leak never counts as displaced.
bool ExactReferee::seen_nearby(const Ray& ray, const Truth& truth, std::uint32_t prim_id) const {
    double size = 0;
    double reach = 0;
    for (const std::uint32_t id : {truth.prim_id, prim_id}) {
        if (id == kNoPrim) continue;
        if (usable_[id] == 0) return false;
        const ExactTriangle one = triangle(ray, id);
        size = std::max(size, one.size());
        for (const vec3 p :
             {positions_[topology_->triangles[id].x], positions_[topology_->triangles[id].y],
              positions_[topology_->triangles[id].z]}) {
            reach = std::max(reach, largest_magnitude(p - ray.org));
        }
    }
    const double radius = kDisplacement * size + kFarDisplacement * reach;
    ParallelView view(ray);
    for (const std::uint32_t id : find_candidates(ray, 2 * radius)) {
        const uvec3 t = topology_->triangles[id];
        if (usable_[id] != 0) view.add(id, positions_[t.x], positions_[t.y], positions_[t.z]);
    }
    if (view.shows(prim_id, radius, kCloseUlps)) return true;
    if (prim_id == kNoPrim || triangle(ray, prim_id).has_t()) return false;
    const uvec3 t = topology_->triangles[prim_id];
    return view.grazes(positions_[t.x], positions_[t.y], positions_[t.z], radius,
                       truth.hit() ? truth.t : std::numeric_limits<double>::infinity(), kCloseUlps);
}

Verdict ExactReferee::judge(const Ray& ray, const Truth& truth, std::uint32_t prim_id) const {
    if (prim_id == truth.prim_id) return Verdict::kRight;
    const std::optional<ExactTriangle> expected =
        truth.hit() ? std::optional(triangle(ray, truth.prim_id)) : std::nullopt;
    const std::optional<ExactTriangle> answered = prim_id != kNoPrim && usable_[prim_id] != 0
                                                      ? std::optional(triangle(ray, prim_id))
                                                      : std::nullopt;
    // The t of the answered plane exceeds the exact one by so many ulps.
    double t_ulps = 0;
    if (expected && answered && answered->has_t()) {
        const bool is_hit = answered->is_met() && answered->in_range();
        if (is_hit && answered->compare_t(*expected) == 0) return Verdict::kRight;
        t_ulps = (answered->t() - truth.t) / ulp_of(std::max(std::abs(answered->t()), truth.t));
        if (is_hit && t_ulps <= kCloseUlps) return Verdict::kClose;
    }
    if (seen_nearby(ray, truth, prim_id)) return Verdict::kDisplaced;
    if (!expected) return Verdict::kFalseHit;
    if (answered && answered->has_t() && std::abs(t_ulps) <= kCloseUlps &&
        answered->edge_distance() < kNearEdge)
        return Verdict::kBeside;
    const bool passes = prim_id == kNoPrim || t_ulps > kCloseUlps;
    if (passes && expected->edge_distance() < kNearEdge) return Verdict::kLeak;
    return prim_id == kNoPrim ? Verdict::kFalseMiss : Verdict::kWrongTriangle;
}

}  // namespace mray::accuracy
