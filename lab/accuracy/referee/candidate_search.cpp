#include "lab/accuracy/referee/candidate_search.h"

#include <algorithm>
#include <cmath>

#include "common/bvh/box.h"

namespace mray::accuracy {
namespace {

// Far above the 2^-53 of a double, far below the resolution of a tracer in float.
constexpr double kRounding = 0x1p-40;

Double3 to_double(vec3 v) { return {v.x, v.y, v.z}; }

/// Whether the ray meets a slab; narrows [enter, leave]. Does not divide by zero: a ray parallel to
/// the slab is inside or outside.
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

bool meets(const Box& box, const Double3& org, const Double3& dir, double margin) {
    if (box.empty()) return false;
    const Double3 lower = to_double(box.lower);
    const Double3 upper = to_double(box.upper);
    double enter = 0;
    double leave = INFINITY;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!meet_slab(lower[axis] - margin, upper[axis] + margin, org[axis], dir[axis], enter,
                       leave)) {
            return false;
        }
    }
    return true;
}

double largest_of(const Bvh& bvh) {
    const Box box = node_box(bvh.nodes[0]);
    if (box.empty()) return 0;
    return std::max(largest_magnitude(box.lower), largest_magnitude(box.upper));
}

}  // namespace

double largest_magnitude(vec3 v) {
    return std::max({std::abs(double{v.x}), std::abs(double{v.y}), std::abs(double{v.z})});
}

CandidateSearch::CandidateSearch(const Bvh& bvh)
    : bvh_(&bvh), rounding_(kRounding * largest_of(bvh)) {}

void CandidateSearch::find(const Ray& ray, double margin, std::vector<std::uint32_t>& found) const {
    found.clear();
    const Double3 org = to_double(ray.org);
    const Double3 dir = to_double(ray.dir);
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
            if (meets(slot_box(node, slot), org, dir, around)) stack[size++] = node.child[slot];
        }
    }
}

}  // namespace mray::accuracy
