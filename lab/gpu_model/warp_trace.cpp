#include "lab/gpu_model/warp_trace.h"

#include <algorithm>
#include <array>

#include "common/interop/hit_rule.h"

namespace mray::lab {
namespace {

/// What a lane does in a step. Lanes that are at the same turn of the same loops step together, and
/// those at an earlier one go first: so all wait for each other at the end of a loop.
struct LaneStep {
    std::array<std::uint32_t, 4> turn;
    StepKind kind;
    /// Its loads' first in WarpTracer::loads_; all lanes of a step have as many.
    std::size_t loads_begin, loads_end;
};

/// Arrays in a device's memory.
enum class Array : std::uint64_t { kNodes, kLeaves, kNodeBoxes, kLeafBoxes };

// Turns within the visit of a node or leaf.
constexpr std::uint32_t kLeafVisits = 1u << 16;
constexpr std::uint32_t kAfterTriangles = 100;
constexpr std::uint32_t kAfterAll = 200;

/// Traces lane after lane, and then finds what they do at once.
class WarpTracer {
public:
    WarpTracer(Kernel kernel, bool any_hit)
        : is_first_(kernel == Kernel::kFirst), any_hit_(any_hit) {}

    template <class Tree>
    WarpTrace trace(const Tree& tree, std::span<const Ray> rays) {
        for (lane_ = 0; lane_ < rays.size(); ++lane_) {
            ray_ = rays[lane_];
            slab_ = slab_ray(ray_.org, ray_.dir);
            sheared_ = shear_ray(ray_.org, ray_.dir);
            t_ = ray_.tfar;
            prim_ = kNoPrim;
            current_ = {};
            stack_.clear();
            round_ = visit_ = 0;
            end_step(StepKind::kBegin);
            const std::uint32_t open_before = trace_.open;
            for (round_ = 1; !is_finished(); ++round_) trace_round(tree);
            trace_.hits += has_hit() ? 1 : 0;
            if (any_hit_ && has_hit()) trace_.open = open_before;
        }
        std::ranges::stable_sort(steps_, {}, &LaneStep::turn);
        for (std::size_t begin = 0, end = 0; begin < steps_.size(); begin = end) {
            while (end < steps_.size() && steps_[end].turn == steps_[begin].turn) ++end;
            add_warp_step({&steps_[begin], end - begin});
        }
        return std::move(trace_);
    }

private:
    struct Entry {
        std::uint32_t child = 0;
        float key = 0;
    };

    bool has_hit() const { return prim_ != kNoPrim; }
    bool is_finished() const { return current_.child == kEmptyChild; }
    bool at_leaf() const { return is_leaf(current_.child) && !is_finished(); }

    /// Loads `count` vectors of 16 bytes, each `stride` bytes after the last.
    void load(Array array, std::uint64_t byte, std::uint32_t count = 1, std::uint32_t stride = 16) {
        for (std::uint32_t k = 0; k < count; ++k, byte += stride)
            loads_.push_back((static_cast<std::uint64_t>(array) << 34 | byte) / 32);
    }

    /// The top entry of the stack, of which each word lies lane by lane.
    void touch_stack(std::uint32_t words = 2) {
        for (std::uint32_t word = 0; word < words; ++word)
            loads_.push_back(kStackSector + 4 * (stack_.size() * words + word) + lane_ / 8);
    }

    void end_step(StepKind kind, std::uint32_t item = 0, std::uint32_t detail = 0) {
        const std::size_t begin = steps_.empty() ? 0 : steps_.back().loads_end;
        steps_.push_back({{round_, visit_, item, detail}, kind, begin, loads_.size()});
    }

    void add_warp_step(std::span<const LaneStep> lanes) {
        const auto first_sector = static_cast<std::ptrdiff_t>(trace_.sectors.size());
        const auto add = [](std::vector<std::uint64_t>& items, std::ptrdiff_t begin,
                            std::uint64_t item) {
            if (std::find(items.begin() + begin, items.end(), item) == items.end())
                items.push_back(item);
        };
        std::size_t wavefronts = 0;
        std::vector<std::uint64_t> lines;
        for (std::size_t k = 0; k < lanes[0].loads_end - lanes[0].loads_begin; ++k) {
            lines.clear();
            for (const LaneStep& lane : lanes) {
                const std::uint64_t sector = loads_[lane.loads_begin + k];
                add(lines, 0, sector / 4);
                add(trace_.sectors, first_sector, sector);
            }
            const bool is_stack = lines[0] >= kStackSector / 4;
            wavefronts += is_stack ? lines.size() : std::max(lines.size(), (lanes.size() + 7) / 8);
        }
        trace_.steps.push_back({lanes[0].kind, static_cast<std::uint8_t>(lanes.size()),
                                static_cast<std::uint32_t>(wavefronts),
                                static_cast<std::uint32_t>(trace_.sectors.size())});
    }

    bool meets(const Box& box, float& key) {
        return !box.empty() && hits_box(slab_, box.lower, box.upper, key) && key <= last_depth(t_);
    }

    void decide(const std::array<vec3, 3>& corners, std::uint32_t prim) {
        const auto& [a, b, c] = corners;
        TriangleHit hit;
        const bool is_hit = intersect_triangle(sheared_, ray_.tnear, ray_.tfar, a, b, c, hit);
        if (!is_hit || !is_closer(hit.t, prim, t_, prim_)) return;
        t_ = hit.t;
        prim_ = prim;
    }

    /// A round of the kernels over the shared layout: nodes, and then a leaf, or all leaves that
    /// follow each other.
    void trace_round(const Bvh& bvh) {
        for (visit_ = 0; !is_leaf(current_.child); ++visit_) visit_node(bvh.nodes[current_.child]);
        for (visit_ = kLeafVisits; at_leaf(); ++visit_) {
            visit_leaf(bvh.leaves[leaf_of(current_.child)], leaf_of(current_.child));
            if (!is_first_) return;
        }
    }

    void visit_node(const Node& node) {
        const std::uint64_t index = current_.child;
        const std::uint64_t at = sizeof(Node) * index;
        current_ = {kEmptyChild, kInfiniteT};
        if (is_first_) {
            load(Array::kNodes, at, kNodeVec4s);
        } else {
            trace_.boxes += 4;
            load(Array::kNodeBoxes, 96 * index, 6);
            end_step(StepKind::kNode);
        }
        std::uint32_t met = 0;
        for (std::uint32_t slot = 0; slot < kWidth; slot += 4) {
            Box box;
            float key;
            for (std::uint32_t k = 0; k < 4; ++k) box.extend(slot_box(node, slot + k));
            if (is_first_ || meets(box, key)) visit_quarter(node, at, slot, ++met);
        }
        if (is_first_) end_step(StepKind::kNode);
        if (is_finished()) pop();
    }

    void visit_quarter(const Node& node, std::uint64_t at, std::uint32_t slot, std::uint32_t item) {
        trace_.boxes += 4;
        std::array<float, 4> keys;
        std::array<bool, 4> met;
        for (std::uint32_t k = 0; k < 4; ++k) met[k] = meets(slot_box(node, slot + k), keys[k]);
        if (!is_first_) {
            load(Array::kNodes, at + 4 * slot, 7, 4 * kPlaneStride);
            end_step(StepKind::kQuarter, item);
        }
        for (std::uint32_t k = 0; k < 4; ++k) {
            if (is_first_) touch_stack();
            if (met[k]) consider({child_of(node, slot + k), keys[k]}, item, 1 + k);
        }
    }

    void consider(Entry child, std::uint32_t item, std::uint32_t detail) {
        if (!is_first_) {
            touch_stack();
            end_step(StepKind::kPush, item, detail);
        }
        const bool is_nearer = child.key < current_.key;
        if (!is_finished()) stack_.push_back(is_nearer ? current_ : child);
        if (is_nearer) current_ = child;
    }

    void pop() {
        std::uint32_t tries = 0;
        do {
            touch_stack();
            end_step(StepKind::kPop, kAfterAll, tries++);
            current_.child = kEmptyChild;
            if (stack_.empty()) return;
            if (stack_.back().key <= last_depth(t_)) current_ = stack_.back();
            stack_.pop_back();
        } while (is_finished() && !stack_.empty());
    }

    void visit_leaf(const Leaf& leaf, std::uint64_t index) {
        const std::uint64_t at = sizeof(Leaf) * index;
        load(Array::kLeaves, at);
        end_step(StepKind::kLeaf);
        const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
        const bool in_groups = !is_first_ && count > 4;
        if (in_groups) {
            trace_.boxes += 4;
            load(Array::kLeafBoxes, 96 * index, 6);
            end_step(StepKind::kGroups, 0, 1);
        }
        std::uint32_t tests = 0;
        std::uint32_t sure = 0;
        std::array<bool, 4> is_group_met;
        for (std::uint32_t group = 0; group < 4; ++group)
            is_group_met[group] = !in_groups || meets_group(leaf, 4 * group, count);
        for (std::uint32_t slot = 0; slot < count; ++slot) {
            if (!is_group_met[slot / 4]) continue;
            load(Array::kLeaves, at + 16 * slot);
            for (std::uint32_t k = 0; k < 3; ++k)
                load(Array::kLeaves, at + 16 * corner(leaf.vertex[slot].corners, k));
            end_step(StepKind::kTriangle, ++tests);
            if (!test_triangle(corners_of(leaf, slot), leaf.prim_id[slot])) continue;
            ++sure;
            if (!is_first_) end_step(StepKind::kHit, tests, 1);
        }
        // A loop of the first kernel runs at least once.
        for (std::uint32_t k = 0; is_first_ && k < std::max(sure, 1u); ++k) {
            load(Array::kLeaves, at, 5);
            end_step(StepKind::kHit, kAfterTriangles, k);
        }
        if (any_hit_ && has_hit()) stack_.clear();
        pop();
    }

    bool meets_group(const Leaf& leaf, std::uint32_t begin, std::uint32_t count) {
        Box box;
        for (std::uint32_t slot = begin; slot < std::min(begin + 4, count); ++slot)
            for (const vec3 corner : corners_of(leaf, slot)) box.extend(corner);
        float key;
        return meets(padded(box), key);
    }

    static std::array<vec3, 3> corners_of(const Leaf& leaf, std::uint32_t slot) {
        const auto at = [&](std::uint32_t k) {
            const LeafVertex& v = leaf.vertex[corner(leaf.vertex[slot].corners, k)];
            return vec3(v.x, v.y, v.z);
        };
        return {at(0), at(1), at(2)};
    }

    /// Returns whether the triangle may be met.
    bool test_triangle(const std::array<vec3, 3>& corners, std::uint32_t prim) {
        const vec3 a = project_fast(sheared_, corners[0]);
        const vec3 b = project_fast(sheared_, corners[1]);
        const vec3 c = project_fast(sheared_, corners[2]);
        const Edges edges = fast_edges(a, b, c);
        if (!may_be_inside(edges)) return false;
        TriangleHit hit;
        weighted_hit(sheared_, edges, a.z, b.z, c.z, hit);
        const bool is_sure = surely_inside(sheared_, edges) && edges.depth_range < edges.depth_size;
        const bool is_open = is_rough(hit) && may_be_in_range(hit, ray_.tnear, t_);
        trace_.open += !is_first_ && (!is_sure || is_open) ? 1 : 0;
        decide(corners, prim);
        return true;
    }

    /// A round of the peer's kernel: a node, or the triangles of a leaf, which an index finds.
    void trace_round(const PeerTree& tree) {
        const PeerNode& node = tree.nodes[current_.child];
        load(Array::kNodes, 64ull * current_.child, 4);
        end_step(StepKind::kNode);
        if (node.count > 0) end_step(StepKind::kLeaf, 1);
        for (std::uint32_t k = 0; k < node.count; ++k) {
            const std::uint64_t index = node.first + k;
            load(Array::kNodeBoxes, 4 * index);
            load(Array::kLeaves, 48 * index, 3);
            end_step(StepKind::kTriangle, 2 + k);
            const PeerTriangle& t = tree.triangles[index];
            decide({t.a, t.b, t.c}, t.prim_id);
        }
        if (node.count == 0 && meet_children(tree, node.first)) return;
        touch_stack(1);
        end_step(StepKind::kPop, kAfterAll);
        const bool is_end = stack_.empty() || (any_hit_ && has_hit());
        current_ = is_end ? Entry{kEmptyChild} : stack_.back();
        if (!is_end) stack_.pop_back();
    }

    /// Goes to the nearer child that is met, and pushes the other one. Returns whether one is.
    bool meet_children(const PeerTree& tree, std::uint32_t first) {
        trace_.boxes += 2;
        std::array<Entry, 2> children = {Entry{first}, Entry{first + 1}};
        std::array<bool, 2> met;
        for (std::size_t k = 0; k < 2; ++k) {
            const PeerNode& child = tree.nodes[children[k].child];
            met[k] = meets({child.lower, child.upper}, children[k].key);
        }
        const bool is_second = met[1] && (!met[0] || children[1].key < children[0].key);
        current_ = children[is_second ? 1 : 0];
        if (met[0] && met[1]) {
            stack_.push_back(children[is_second ? 0 : 1]);
            touch_stack(1);
            end_step(StepKind::kPush, kAfterTriangles);
        }
        return met[0] || met[1];
    }

    bool is_first_, any_hit_;
    WarpTrace trace_;
    std::vector<LaneStep> steps_;
    /// Sectors.
    std::vector<std::uint64_t> loads_;
    // The lane that is traced, and where it is in the outer loops.
    std::size_t lane_ = 0;
    std::uint32_t round_ = 0, visit_ = 0;
    Ray ray_;
    SlabRay slab_;
    ShearedRay sheared_;
    float t_ = 0;
    std::uint32_t prim_ = kNoPrim;
    Entry current_;
    std::vector<Entry> stack_;
};

}  // namespace

WarpTrace trace_warp(Kernel kernel, const Bvh& bvh, const PeerTree& peer, std::span<const Ray> rays,
                     bool any_hit) {
    WarpTracer tracer(kernel, any_hit);
    return kernel == Kernel::kPeer ? tracer.trace(peer, rays) : tracer.trace(bvh, rays);
}

}  // namespace mray::lab
