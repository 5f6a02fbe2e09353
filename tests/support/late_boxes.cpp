#include "tests/support/late_boxes.h"

#include <algorithm>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/slab.h"

namespace mray::test {
namespace {

constexpr float kUnit = 0x1p16f;
constexpr std::uint32_t kCopies = 64;

const vec3 kEye = vec3(0, 3, 12) * kUnit;

/// The box of a child, which is moved if it is a leaf without the triangle.
Box late_box(Bvh& bvh, std::uint32_t node, std::uint32_t slot, std::uint32_t on_time, vec3 drop) {
    const std::uint32_t child = child_of(bvh.nodes[node], slot);
    if (child == kEmptyChild) return {};
    Box box;
    if (!is_leaf(child)) {
        for (std::uint32_t below = 0; below < kWidth; ++below)
            box.extend(late_box(bvh, child, below, on_time, drop));
    } else {
        const auto& ids = bvh.leaves[leaf_of(child)].prim_id;
        box = slot_box(bvh.nodes[node], slot);
        if (std::find(std::begin(ids), std::end(ids), on_time) == std::end(ids)) {
            box.lower -= drop;
            box.upper -= drop;
        }
    }
    set_slot_box(bvh.nodes[node], slot, box);
    return box;
}

}  // namespace

LateBoxes late_boxes(std::uint32_t on_time) {
    LateBoxes late;
    late.positions = {vec3(-3, 0, -2) * kUnit, vec3(3, 0, -2) * kUnit, vec3(0, 0, 3) * kUnit};
    late.topology.vertex_count = 3;
    late.topology.triangles.assign(kCopies, {0, 1, 2});
    late.topology.albedo.assign(kCopies, kDefaultAlbedo);
    late.bvh = build_bvh(late.topology, late.positions);
    // Rays come down by 3/8 of t.
    const vec3 drop(0, 0.375f * 0.4375f * depth_margin(kEye), 0);
    for (std::uint32_t slot = 0; slot < kWidth; ++slot)
        late_box(late.bvh, 0, slot, on_time == kNoPrim ? kCopies : on_time, drop);
    return late;
}

std::vector<Ray> rays_at_late_boxes(std::size_t count) {
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < count; ++i) {
        const float u = static_cast<float>(i % 31 + 1) / 33;
        const float v = static_cast<float>(i % 17 + 1) / 19 * (1 - u);
        const vec3 target = vec3(6 * u + 3 * v - 3, 0, 5 * v - 2) * kUnit;
        rays.push_back({kEye, 0, canonical_direction(target - kEye), kInfiniteT});
    }
    return rays;
}

}  // namespace mray::test
