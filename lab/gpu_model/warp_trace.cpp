#include "lab/gpu_model/warp_trace.h"

#include <algorithm>
#include <array>
#include <bit>

#include "common/interop/hit_rule.h"

namespace mray::lab {
namespace {

/// A place in a device's memory: the bytes of an array, and its number.
std::uint64_t address(std::uint64_t array, std::uint64_t byte) { return array << 34 | byte; }
std::uint64_t node_at(std::uint64_t node) { return address(0, sizeof(Node) * node); }
std::uint64_t leaf_at(std::uint64_t leaf) { return address(1, sizeof(Leaf) * leaf); }

struct Lane {
    Ray ray;
    SlabRay slab;
    ShearedRay sheared;
    /// The answer.
    float t;
    std::uint32_t prim = kNoPrim;
    struct Entry {
        std::uint32_t child = 0;
        float key = 0;
    };
    Entry current;
    std::vector<Entry> stack;
    /// The node or leaf that is visited; its quarters or triangles that are left, as bits.
    std::uint32_t visited = 0, left = 0;
    /// The slots of a quarter that are met, and their keys.
    std::uint32_t first_slot = 0, met = 0;
    std::array<float, 4> keys = {};
    std::uint32_t sure_count = 0;
    /// Places of open triangles (triangle_at()), and how many leaves these are in.
    std::vector<std::uint32_t> open;
    std::uint32_t open_leaves = 0;

    explicit Lane(const Ray& traced)
        : ray(traced),
          slab(slab_ray(traced.org, traced.dir)),
          sheared(shear_ray(traced.org, traced.dir)),
          t(traced.tfar) {}

    bool has_hit() const { return prim != kNoPrim; }
    bool is_finished() const { return current.child == kEmptyChild; }
    bool at_node() const { return !is_leaf(current.child); }
    bool at_leaf() const { return !at_node() && !is_finished(); }
    std::uint32_t next() const { return static_cast<std::uint32_t>(std::countr_zero(left)); }

    bool meets(const Box& box, float& key) const {
        return !box.empty() && hits_box(slab, box.lower, box.upper, key) && key <= last_depth(t);
    }
    void take(float at, std::uint32_t prim_id) {
        if (!is_closer(at, prim_id, t, prim)) return;
        t = at;
        prim = prim_id;
    }
    void decide(vec3 a, vec3 b, vec3 c, std::uint32_t prim_id) {
        TriangleHit hit;
        if (intersect_triangle(sheared, ray.tnear, ray.tfar, a, b, c, hit)) take(hit.t, prim_id);
    }
};

using Lanes = std::vector<Lane*>;

template <class Test>
Lanes select(const Lanes& lanes, Test test) {
    Lanes selected;
    std::ranges::copy_if(lanes, std::back_inserter(selected), [&](Lane* l) { return test(*l); });
    return selected;
}

/// A warp, and the record of its steps.
class Warp {
public:
    explicit Warp(std::span<const Ray> rays) : lanes_(rays.begin(), rays.end()) {
        for (Lane& lane : lanes_) all_.push_back(&lane);
        trace_.rays = static_cast<std::uint32_t>(rays.size());
        end_step(StepKind::kBegin, all_);
    }

protected:
    /// Loads `count` vectors of 16 bytes from at(lane) on, each `stride` bytes after the last.
    template <class At>
    void load(const Lanes& lanes, At at, std::uint32_t count = 1, std::uint32_t stride = 16) {
        const auto registers = static_cast<std::uint32_t>(lanes.size() + 7) / 8;
        for (std::uint32_t k = 0; k < count; ++k) {
            lines_.clear();
            for (const Lane* lane : lanes) touch((at(*lane) + std::uint64_t{k} * stride) / 32);
            wavefronts_ += std::max(static_cast<std::uint32_t>(lines_.size()), registers);
        }
    }

    /// The top entries of the stacks, of which each word lies lane by lane.
    void touch_stacks(const Lanes& lanes, std::uint32_t words = 2) {
        for (std::uint32_t word = 0; word < words; ++word) {
            lines_.clear();
            for (const Lane* lane : lanes) {
                const auto index = static_cast<std::uint64_t>(lane - lanes_.data());
                touch(kStackSector + 4 * (lane->stack.size() * words + word) + index / 8);
            }
            wavefronts_ += static_cast<std::uint32_t>(lines_.size());
        }
    }

    void end_step(StepKind kind, const Lanes& lanes) {
        if (lanes.empty()) return;
        trace_.steps.push_back({kind, static_cast<std::uint8_t>(lanes.size()), wavefronts_,
                                static_cast<std::uint32_t>(trace_.sectors.size())});
        wavefronts_ = 0;
        step_begin_ = static_cast<std::ptrdiff_t>(trace_.sectors.size());
    }

    std::vector<Lane> lanes_;
    Lanes all_;
    WarpTrace trace_;

private:
    void touch(std::uint64_t sector) {
        if (std::ranges::find(lines_, sector / 4) == lines_.end()) lines_.push_back(sector / 4);
        auto& sectors = trace_.sectors;
        if (std::find(sectors.begin() + step_begin_, sectors.end(), sector) == sectors.end())
            sectors.push_back(sector);
    }

    std::vector<std::uint64_t> lines_;
    std::uint32_t wavefronts_ = 0;
    std::ptrdiff_t step_begin_ = 0;
};

/// The kernels over the shared layout; names as in shaders/.
class LayoutWarp : Warp {
public:
    LayoutWarp(const Bvh& bvh, std::span<const Ray> rays, bool any_hit, KernelForm form)
        : Warp(rays), bvh_(bvh), any_hit_(any_hit), is_first_(form == KernelForm::kFirst) {}

    WarpTrace traverse() {
        for (Lanes left = all_; !left.empty(); left = select(left, &is_unfinished))
            is_first_ ? first_round(left) : round(left);
        for (const Lane& lane : lanes_) {
            trace_.hits += lane.has_hit() ? 1 : 0;
            if (lane.open.empty() || (any_hit_ && lane.has_hit())) continue;
            ++trace_.open_rays;
            trace_.open_triangles += static_cast<std::uint32_t>(lane.open.size());
        }
        return std::move(trace_);
    }

private:
    static bool is_unfinished(const Lane& lane) { return !lane.is_finished(); }
    static bool is_at_node(const Lane& lane) { return lane.at_node(); }
    static bool is_at_leaf(const Lane& lane) { return lane.at_leaf(); }
    static bool has_left(const Lane& lane) { return lane.left != 0; }

    void visit_nodes_of(const Lanes& lanes) {
        for (Lanes at = select(lanes, &is_at_node); !at.empty(); at = select(at, &is_at_node))
            visit_nodes(at);
    }

    void round(const Lanes& lanes) {
        visit_nodes_of(lanes);
        visit_leaves(select(lanes, &is_at_leaf));
    }

    /// Leaves after nodes as long as there is room for open triangles of four leaves, and then
    /// these.
    void first_round(const Lanes& lanes) {
        const auto has_room = [](const Lane& l) { return !l.is_finished() && l.open_leaves < 4; };
        for (Lanes left = lanes; !left.empty(); left = select(left, has_room)) {
            visit_nodes_of(left);
            for (Lanes at = select(left, &is_at_leaf); !at.empty();
                 at = select(select(at, has_room), &is_at_leaf))
                visit_leaves(at);
        }
        const auto has_open = [](const Lane& lane) { return !lane.open.empty(); };
        for (Lanes open = select(lanes, has_open); !open.empty(); open = select(open, has_open)) {
            load(
                open, [](const Lane& l) { return leaf_at(triangle_leaf(l.open.back())); }, 5);
            end_step(StepKind::kOpen, open);
            for (Lane* lane : open) {
                const std::uint32_t at = lane->open.back();
                const auto [a, b, c] = triangle(triangle_leaf(at), triangle_slot(at));
                lane->decide(a, b, c, bvh_.leaves[triangle_leaf(at)].prim_id[triangle_slot(at)]);
                lane->open.pop_back();
            }
        }
        for (Lane* lane : lanes) {
            lane->open_leaves = 0;
            if (any_hit_ && lane->has_hit()) lane->current.child = kEmptyChild;
        }
    }

    void visit_nodes(const Lanes& lanes) {
        for (Lane* lane : lanes) {
            lane->visited = lane->current.child;
            lane->current = {kEmptyChild, kInfiniteT};
            lane->left = is_first_ ? 15 : met_quarters(*lane);
        }
        if (is_first_) {
            load(
                lanes, [](const Lane& l) { return node_at(l.visited); }, kNodeVec4s);
        } else {
            trace_.boxes += 4 * static_cast<std::uint32_t>(lanes.size());
            load(
                lanes, [](const Lane& l) { return address(2, 96 * std::uint64_t{l.visited}); }, 6);
            end_step(StepKind::kNode, lanes);
        }
        for (Lanes at = select(lanes, &has_left); !at.empty(); at = select(at, &has_left))
            visit_quarters(at);
        if (is_first_) end_step(StepKind::kNode, lanes);
        pop(select(lanes, [](const Lane& lane) { return lane.is_finished(); }));
    }

    std::uint32_t met_quarters(const Lane& lane) const {
        std::uint32_t met = 0;
        for (std::uint32_t quarter = 0; quarter < 4; ++quarter) {
            Box box;
            for (std::uint32_t k = 0; k < 4; ++k)
                box.extend(slot_box(bvh_.nodes[lane.visited], 4 * quarter + k));
            float key;
            met |= lane.meets(box, key) ? 1u << quarter : 0;
        }
        return met;
    }

    void visit_quarters(const Lanes& lanes) {
        trace_.boxes += 4 * static_cast<std::uint32_t>(lanes.size());
        for (Lane* lane : lanes) {
            lane->first_slot = 4 * lane->next();
            lane->left &= lane->left - 1;
            lane->met = 0;
            for (std::uint32_t k = 0; k < 4; ++k) {
                const Box box = slot_box(bvh_.nodes[lane->visited], lane->first_slot + k);
                lane->met |= lane->meets(box, lane->keys[k]) ? 1u << k : 0;
            }
        }
        const auto quarter_at = [](const Lane& l) { return node_at(l.visited) + 4 * l.first_slot; };
        const Lanes meeting = select(lanes, [](const Lane& lane) { return lane.met != 0; });
        if (!is_first_) {
            load(lanes, quarter_at, 6, 4 * kPlaneStride);
            end_step(StepKind::kQuarter, lanes);
            load(meeting, [&](const Lane& l) { return quarter_at(l) + 16 * kNodeChild; });
            end_step(StepKind::kChildren, meeting);
        }
        for (std::uint32_t k = 0; k < 4; ++k) {
            const Lanes met = select(meeting, [k](const Lane& l) { return (l.met >> k & 1) != 0; });
            if (is_first_) touch_stacks(lanes);
            if (!is_first_) push_steps(met);
            for (Lane* lane : met)
                consider(*lane, {child_of(bvh_.nodes[lane->visited], lane->first_slot + k),
                                 lane->keys[k]});
        }
    }

    void push_steps(const Lanes& met) {
        end_step(StepKind::kChild, met);
        const Lanes pushing = select(met, &is_unfinished);
        touch_stacks(pushing);
        end_step(StepKind::kPush, pushing);
    }

    static void consider(Lane& lane, Lane::Entry child) {
        const bool is_nearer = child.key < lane.current.key;
        if (!lane.is_finished()) lane.stack.push_back(is_nearer ? lane.current : child);
        if (is_nearer) lane.current = child;
    }

    void pop(Lanes lanes) {
        const auto goes_on = [](const Lane& l) { return l.is_finished() && !l.stack.empty(); };
        for (; !lanes.empty(); lanes = select(lanes, goes_on)) {
            touch_stacks(lanes);
            end_step(StepKind::kPop, lanes);
            for (Lane* lane : lanes) {
                lane->current.child = kEmptyChild;
                if (lane->stack.empty()) continue;
                if (lane->stack.back().key <= last_depth(lane->t))
                    lane->current = lane->stack.back();
                lane->stack.pop_back();
            }
        }
    }

    void visit_leaves(const Lanes& lanes) {
        for (Lane* lane : lanes) {
            lane->visited = leaf_of(lane->current.child);
            const LeafVertex& first = bvh_.leaves[lane->visited].vertex[0];
            lane->left = (1u << corner_triangle_count(first.corners)) - 1;
            lane->sure_count = 0;
        }
        const auto leaf = [](const Lane& lane) { return leaf_at(lane.visited); };
        load(lanes, leaf);
        end_step(StepKind::kLeaf, lanes);
        if (!is_first_) meet_groups(select(lanes, [](const Lane& lane) { return lane.left > 15; }));
        for (Lanes at = select(lanes, &has_left); !at.empty(); at = select(at, &has_left))
            test_triangles(at);
        // A loop of the first form runs at least once.
        for (std::uint32_t k = 0; is_first_ && k < kLeafTriangles; ++k) {
            const Lanes sure = select(lanes, [k](const Lane& l) { return k < l.sure_count; });
            if (k > 0 && sure.empty()) break;
            load(k == 0 ? lanes : sure, leaf, 5);
            end_step(StepKind::kHit, k == 0 ? lanes : sure);
        }
        for (Lane* lane : lanes)
            if (any_hit_ && lane->has_hit()) lane->stack.clear();
        pop(lanes);
    }

    void meet_groups(const Lanes& lanes) {
        trace_.boxes += 4 * static_cast<std::uint32_t>(lanes.size());
        load(
            lanes, [](const Lane& l) { return address(3, 96 * std::uint64_t{l.visited}); }, 6);
        end_step(StepKind::kGroups, lanes);
        for (Lane* lane : lanes) {
            for (std::uint32_t group = 0; group < 4; ++group) {
                Box box;
                for (std::uint32_t k = 4 * group; k < 4 * group + 4; ++k)
                    if ((lane->left >> k & 1) != 0)
                        for (const vec3 v : triangle(lane->visited, k)) box.extend(v);
                float key;
                if (!lane->meets(padded(box), key)) lane->left &= ~(15u << 4 * group);
            }
        }
    }

    std::array<vec3, 3> triangle(std::uint32_t leaf, std::uint32_t slot) const {
        const PerVertex<LeafVertex>& from = bvh_.leaves[leaf].vertex;
        const auto at = [&](std::uint32_t k) {
            const LeafVertex& v = from[corner(from[slot].corners, k)];
            return vec3(v.x, v.y, v.z);
        };
        return {at(0), at(1), at(2)};
    }

    void test_triangles(const Lanes& lanes) {
        trace_.triangles += static_cast<std::uint32_t>(lanes.size());
        load(lanes, [](const Lane& l) { return leaf_at(l.visited) + 16 * l.next(); });
        for (std::uint32_t k = 0; k < 3; ++k)
            load(lanes, [&](const Lane& l) {
                const std::uint32_t corners = bvh_.leaves[l.visited].vertex[l.next()].corners;
                return leaf_at(l.visited) + 16 * corner(corners, k);
            });
        end_step(StepKind::kTriangle, lanes);
        Lanes inside;
        for (Lane* lane : lanes) {
            if (test_triangle(*lane, lane->next())) inside.push_back(lane);
            lane->left &= lane->left - 1;
        }
        if (!is_first_) end_step(StepKind::kHit, inside);
    }

    /// Returns whether the triangle may be met.
    bool test_triangle(Lane& lane, std::uint32_t slot) const {
        const auto [a, b, c] = triangle(lane.visited, slot);
        const vec3 pa = project_fast(lane.sheared, a);
        const vec3 pb = project_fast(lane.sheared, b);
        const vec3 pc = project_fast(lane.sheared, c);
        const Edges e = fast_edges(pa, pb, pc);
        if (!may_be_inside(e)) return false;
        const bool is_sure = surely_inside(lane.sheared, e) && e.depth_range < e.depth_size;
        TriangleHit hit;
        weighted_hit(lane.sheared, e, pa.z, pb.z, pc.z, hit);
        const std::uint32_t prim = bvh_.leaves[lane.visited].prim_id[slot];
        if (is_sure && (is_first_ || !is_rough(hit))) {
            ++lane.sure_count;
            if (is_in_range(hit.t, lane.ray.tnear, lane.t)) lane.take(hit.t, prim);
            return true;
        }
        if (is_sure && !may_be_in_range(hit, lane.ray.tnear, lane.t)) return true;
        if (is_sure && hit.t > hit.error && hit.t + hit.error < lane.t) {
            lane.t = hit.t + hit.error;
            if (any_hit_) lane.prim = prim;
        }
        const bool is_same = !lane.open.empty() && triangle_leaf(lane.open.back()) == lane.visited;
        lane.open_leaves += is_same ? 0 : 1;
        lane.open.push_back(triangle_at(lane.visited, slot));
        return true;
    }

    const Bvh& bvh_;
    bool any_hit_, is_first_;
};

class PeerWarp : Warp {
public:
    PeerWarp(const PeerTree& tree, std::span<const Ray> rays, bool any_hit)
        : Warp(rays), tree_(tree), any_hit_(any_hit) {}

    WarpTrace traverse() {
        const auto is_unfinished = [](const Lane& lane) { return !lane.is_finished(); };
        for (Lanes left = all_; !left.empty(); left = select(left, is_unfinished)) {
            load(
                left, [](const Lane& l) { return node_at(0) + 64ull * l.current.child; }, 4);
            end_step(StepKind::kNode, left);
            const auto is_at_leaf = [&](const Lane& lane) { return node_of(lane).count > 0; };
            const Lanes at_leaf = select(left, is_at_leaf);
            test_leaves(at_leaf);
            Lanes popping = at_leaf;
            Lanes pushing;
            for (Lane* lane : left) {
                if (is_at_leaf(*lane)) continue;
                const std::size_t met = meet_children(*lane);
                if (met == 0) popping.push_back(lane);
                if (met == 2) pushing.push_back(lane);
            }
            touch_stacks(pushing, 1);
            end_step(StepKind::kPush, pushing);
            touch_stacks(popping, 1);
            end_step(StepKind::kPop, popping);
            for (Lane* lane : popping) {
                const bool is_end = lane->stack.empty() || (any_hit_ && lane->has_hit());
                lane->current = is_end ? Lane::Entry{kEmptyChild} : lane->stack.back();
                if (!is_end) lane->stack.pop_back();
            }
        }
        for (const Lane& lane : lanes_) trace_.hits += lane.has_hit() ? 1 : 0;
        return std::move(trace_);
    }

private:
    const PeerNode& node_of(const Lane& lane) const { return tree_.nodes[lane.current.child]; }

    /// Goes to the nearer child that is met, and pushes the other one. Returns how many are met.
    std::size_t meet_children(Lane& lane) {
        trace_.boxes += 2;
        std::array<Lane::Entry, 2> met;
        std::size_t count = 0;
        for (std::uint32_t child = node_of(lane).first, k = 0; k < 2; ++k, ++child) {
            met[count].child = child;
            const Box box{tree_.nodes[child].lower, tree_.nodes[child].upper};
            count += lane.meets(box, met[count].key) ? 1 : 0;
        }
        if (count == 2 && met[1].key < met[0].key) std::swap(met[0], met[1]);
        if (count > 0) lane.current = met[0];
        if (count == 2) lane.stack.push_back(met[1]);
        return count;
    }

    void test_leaves(Lanes lanes) {
        end_step(StepKind::kLeaf, lanes);
        for (std::uint32_t k = 0; !lanes.empty(); ++k) {
            lanes = select(lanes, [&](const Lane& lane) { return k < node_of(lane).count; });
            const auto index = [&](const Lane& lane) { return node_of(lane).first + k; };
            load(lanes, [&](const Lane& l) { return address(2, 4ull * index(l)); });
            load(
                lanes, [&](const Lane& l) { return address(1, 48ull * index(l)); }, 3);
            end_step(StepKind::kTriangle, lanes);
            trace_.triangles += static_cast<std::uint32_t>(lanes.size());
            for (Lane* lane : lanes) {
                const PeerTriangle& t = tree_.triangles[index(*lane)];
                lane->decide(t.a, t.b, t.c, t.prim_id);
            }
        }
    }

    const PeerTree& tree_;
    bool any_hit_;
};

}  // namespace

WarpTrace trace_warp(const Bvh& bvh, std::span<const Ray> rays, bool any_hit, KernelForm form) {
    return LayoutWarp(bvh, rays, any_hit, form).traverse();
}

WarpTrace trace_warp(const PeerTree& tree, std::span<const Ray> rays, bool any_hit) {
    return PeerWarp(tree, rays, any_hit).traverse();
}

}  // namespace mray::lab
