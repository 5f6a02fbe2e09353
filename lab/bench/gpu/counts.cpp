// What a ray costs, counted on the CPU in the order of the device's traversal.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <functional>
#include <vector>

#include <glm/common.hpp>

#include "common/bvh/bvh.h"
#include "common/interop/hit_rule.h"
#include "common/interop/slab.h"
#include "common/report/table.h"
#include "lab/bench/gpu/peer_interface.h"
#include "lab/bench/gpu/peer_tree.h"
#include "lab/bench/gpu/vulkan_work.h"
#include "lab/bench/trace_work.h"
#include "lab/bench/works/ours.h"
#include "shaders/kernel_interface.h"

namespace mray::bench {
namespace {

struct Counts {
    std::uint64_t nodes = 0, leaves = 0, boxes = 0, triangles = 0, bytes = 0;
};

struct Box {
    vec3 lower = vec3(kEmptyPlane);
    vec3 upper = vec3(-kEmptyPlane);
    void add(const Box& box) {
        lower = glm::min(lower, box.lower);
        upper = glm::max(upper, box.upper);
    }
};

Box slot_box(const Node& n, std::uint32_t i) {
    return {{n.lower_x[i], n.lower_y[i], n.lower_z[i]}, {n.upper_x[i], n.upper_y[i], n.upper_z[i]}};
}

std::array<vec3, 3> triangle_of(const Leaf& leaf, std::uint32_t i) {
    std::array<vec3, 3> points;
    for (std::uint32_t k = 0; k < 3; ++k) {
        const LeafVertex& v = leaf.vertex[corner(leaf.vertex[i].corners, k)];
        points[k] = {v.x, v.y, v.z};
    }
    return points;
}

/// Which boxes beside the shared layout are tested.
struct Parts {
    bool quarters;
    bool groups;
};

/// One ray through the shared layout as `traverse.glsl` takes it.
class SharedWalk {
public:
    SharedWalk(const Bvh& bvh, const Parts& parts, Counts& counts)
        : bvh_(bvh), parts_(parts), counts_(counts) {}

    void trace(const Ray& ray) {
        ray_ = ray;
        slab_ = slab_ray(ray.org, ray.dir);
        sheared_ = shear_ray(ray.org, ray.dir);
        best_t_ = ray.tfar;
        best_prim_ = kNoPrim;
        std::vector<std::pair<std::uint32_t, float>> stack = {{0, 0.0f}};
        while (!stack.empty()) {
            const auto [child, least] = stack.back();
            stack.pop_back();
            if (least > last_depth(best_t_)) continue;
            if ((child & kLeafBit) != 0) {
                visit(bvh_.leaves[child & ~kLeafBit]);
                continue;
            }
            std::vector<std::pair<std::uint32_t, float>> met = visit(bvh_.nodes[child]);
            std::ranges::sort(met, {}, [](const auto& m) { return -m.second; });
            stack.insert(stack.end(), met.begin(), met.end());
        }
    }

private:
    bool meets(const Box& box, float& least) const {
        return hits_box(slab_, box.lower, box.upper, least) && least <= last_depth(best_t_);
    }

    std::vector<std::pair<std::uint32_t, float>> visit(const Node& node) {
        std::vector<std::pair<std::uint32_t, float>> met;
        ++counts_.nodes;
        float least = 0;
        if (parts_.quarters) counts_.boxes += 4, counts_.bytes += 16 * kQuarterVec4s;
        for (std::uint32_t quarter = 0; quarter < 4; ++quarter) {
            Box all;
            for (std::uint32_t i = 4 * quarter; i < 4 * quarter + 4; ++i)
                all.add(slot_box(node, i));
            if (parts_.quarters && !meets(all, least)) continue;
            counts_.boxes += 4;
            counts_.bytes += 16 * 7;
            for (std::uint32_t i = 4 * quarter; i < 4 * quarter + 4; ++i) {
                if (node.child[i] != kEmptyChild && meets(slot_box(node, i), least))
                    met.emplace_back(node.child[i], least);
            }
        }
        return met;
    }

    void visit(const Leaf& leaf) {
        ++counts_.leaves;
        const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
        const bool has_groups = parts_.groups && count > 4;
        counts_.bytes += 16;
        if (has_groups) counts_.boxes += 4, counts_.bytes += 16 * kQuarterVec4s;
        for (std::uint32_t first = 0; first < count; first += 4) {
            const std::uint32_t end = std::min(first + 4, count);
            Box group;
            for (std::uint32_t i = first; i < end; ++i)
                for (const vec3& p : triangle_of(leaf, i)) group.add({p, p});
            const float extent = largest_extent(group.lower, group.upper);
            for (int k = 0; k < 3; ++k) {
                group.lower[k] -= plane_pad(group.lower[k], extent);
                group.upper[k] += plane_pad(group.upper[k], extent);
            }
            float least = 0;
            if (has_groups && !meets(group, least)) continue;
            for (std::uint32_t i = first; i < end; ++i) {
                ++counts_.triangles;
                counts_.bytes += 64;
                const auto [a, b, c] = triangle_of(leaf, i);
                TriangleHit hit;
                const bool is_hit =
                    intersect_triangle(sheared_, ray_.tnear, ray_.tfar, a, b, c, hit);
                if (!is_hit || !is_closer(hit.t, leaf.prim_id[i], best_t_, best_prim_)) continue;
                best_t_ = hit.t;
                best_prim_ = leaf.prim_id[i];
            }
        }
    }

    const Bvh& bvh_;
    Parts parts_;
    Counts& counts_;
    Ray ray_ = {};
    SlabRay slab_ = {};
    ShearedRay sheared_ = {};
    float best_t_ = 0;
    std::uint32_t best_prim_ = kNoPrim;
};

/// One ray through the peer's tree.
void trace_peer(const PeerTree& tree, const Ray& ray, Counts& counts) {
    const ShearedRay sheared = shear_ray(ray.org, ray.dir);
    const vec3 inv = 1.0f / glm::mix(ray.dir, vec3(1e-30f), glm::equal(ray.dir, vec3(0.0f)));
    float best = ray.tfar;
    std::vector<std::pair<int, float>> stack = {{0, 0.0f}};
    while (!stack.empty()) {
        const auto [node, enter] = stack.back();
        stack.pop_back();
        if (enter > best) continue;
        if (node < 0) {
            ++counts.leaves;
            for (int i = ~node >> 3; i < (~node >> 3) + (~node & 7); ++i) {
                ++counts.triangles;
                counts.bytes += 16 * kPeerTriangleVec4s;
                const vec4* const v =
                    &tree.triangles[static_cast<std::size_t>(i) * kPeerTriangleVec4s];
                TriangleHit hit;
                if (intersect_triangle(sheared, ray.tnear, ray.tfar, vec3(v[0]), vec3(v[1]),
                                       vec3(v[2]), hit))
                    best = std::min(best, hit.t);
            }
            continue;
        }
        const vec4* const n = &tree.nodes[static_cast<std::size_t>(node) * kPeerNodeVec4s];
        ++counts.nodes;
        counts.boxes += 2;
        counts.bytes += 16 * kPeerNodeVec4s;
        std::array<std::pair<int, float>, 2> children;
        for (std::size_t k = 0; k < 2; ++k) {
            const vec4 xy = n[k];
            const float lower_z = k == 0 ? n[2].x : n[2].z;
            const float upper_z = k == 0 ? n[2].y : n[2].w;
            const vec3 a = (vec3(xy.x, xy.z, lower_z) - ray.org) * inv;
            const vec3 b = (vec3(xy.y, xy.w, upper_z) - ray.org) * inv;
            const vec3 near = glm::min(a, b);
            const vec3 far = glm::max(a, b);
            const float first = std::max({near.x, near.y, near.z, ray.tnear});
            const float last = std::min({far.x, far.y, far.z, best});
            children[k] = {std::bit_cast<int>(k == 0 ? n[3].x : n[3].y),
                           first <= last ? first : kInfiniteT};
        }
        if (children[0].second < children[1].second) std::swap(children[0], children[1]);
        for (const auto& child : children)
            if (child.second < kInfiniteT) stack.push_back(child);
    }
}

/// Some of the rays, spread over all.
std::vector<Ray> sample(const TraceWork& work) {
    constexpr std::size_t kMost = 20000;
    std::vector<Ray> rays;
    const std::size_t step = std::max<std::size_t>(work.rays.size() / kMost, 1) | 1;
    for (std::size_t i = 0; i < work.rays.size(); i += step)
        if (work.active[i] != 0) rays.push_back(work.rays[i]);
    return rays;
}

}  // namespace

std::string count_table(const BenchScene& scene) {
    const TraceWork primary = make_primary_work(scene.params);
    const AlignedVector<Hit> hits = reference_hits(scene.bvh, primary);
    const TraceWork diffuse = make_secondary_work(primary, hits, scene.mesh(), WorkKind::kDiffuse);
    const PeerTree peer = build_peer_tree(scene.topology().triangles, scene.positions);
    Table table({"scene", "rays", "tree", "nodes", "leaves", "boxes", "triangles", "bytes"});
    const auto add = [&](const char* work, const char* tree, const std::vector<Ray>& rays,
                         const Counts& counts) {
        const auto each = [&](std::uint64_t n) {
            return fmt::format("{:.1f}",
                               static_cast<double>(n) /
                                   static_cast<double>(std::max<std::size_t>(rays.size(), 1)));
        };
        table.add({scene.name, work, tree, each(counts.nodes), each(counts.leaves),
                   each(counts.boxes), each(counts.triangles), each(counts.bytes)});
    };
    for (const TraceWork* const work : {&primary, &diffuse}) {
        const std::vector<Ray> rays = sample(*work);
        const char* const name = work == &primary ? "camera" : "diffuse";
        struct Case {
            const char* name;
            Parts parts;
        };
        for (const Case& c :
             {Case{"shared layout", {false, false}}, Case{"and quarters", {true, false}},
              Case{"and groups", {true, true}}}) {
            Counts counts;
            SharedWalk walk(scene.bvh, c.parts, counts);
            for (const Ray& ray : rays) walk.trace(ray);
            add(name, c.name, rays, counts);
        }
        Counts counts;
        for (const Ray& ray : rays) trace_peer(peer, ray, counts);
        add(name, "bvh2", rays, counts);
    }
    return table.text();
}

}  // namespace mray::bench
