#include "lab/gpu_model/warp_trace.h"

#include <algorithm>
#include <array>
#include <set>

#include "cpu/reference/scalar_tracer.h"

namespace mray::lab {
namespace {

/// What a lane does in a step. Lanes that are at the same turn of the same loops step together, and
/// those at an earlier one go first: so all wait for each other at the end of a loop.
struct LaneStep {
    std::array<std::uint32_t, 4> turn;
    StepKind kind;
    /// Sectors; all lanes of a step load as many.
    std::vector<std::uint64_t> loads;
};

/// Arrays in a device's memory.
enum class Array : std::uint64_t { kNodes, kLeaves, kNodeBoxes, kLeafBoxes };

// Turns within the visit of a node or leaf.
constexpr std::uint32_t kLeafVisit = 1u << 16;
constexpr std::uint32_t kAfterTriangles = 100;
constexpr std::uint32_t kAfterAll = 200;

Step warp_step(std::span<const LaneStep> lanes) {
    Step step{lanes[0].kind, lanes.size()};
    for (std::size_t k = 0; k < lanes[0].loads.size(); ++k) {
        std::set<std::uint64_t> lines;
        for (const LaneStep& lane : lanes) {
            const std::uint64_t sector = lane.loads[k];
            lines.insert(sector / 4);
            if (std::ranges::find(step.sectors, sector) == step.sectors.end())
                step.sectors.push_back(sector);
        }
        const bool is_stack = *lines.begin() >= kStackSector / 4;
        step.wavefronts += is_stack ? lines.size() : std::max(lines.size(), (lanes.size() + 7) / 8);
    }
    return step;
}

/// Traces a ray as a lane, and notes its steps.
class Lane {
public:
    Lane(const Ray& ray, std::size_t number, bool any_hit)
        : ray_(ray), number_(number), any_hit_(any_hit) {}

    template <class Tree>
    void trace(const Tree& tree, WarpTrace& to, std::vector<LaneStep>& steps) {
        end_step(StepKind::kBegin);
        for (round_ = 1; !is_finished(); ++round_) trace_round(tree);
        to.hits += has_hit() ? 1 : 0;
        to.boxes += boxes_;
        to.open += any_hit_ && has_hit() ? 0 : open_;
        std::ranges::move(steps_, std::back_inserter(steps));
    }

private:
    struct Entry {
        std::uint32_t child = 0;
        float key = 0;
    };

    bool has_hit() const { return closest_.hit().prim_id != kNoPrim; }
    bool is_finished() const { return current_.child == kEmptyChild; }

    /// Loads `count` vectors of 16 bytes, each `stride` bytes after the last.
    void load(Array array, std::uint64_t byte, std::uint32_t count = 1, std::uint32_t stride = 16) {
        for (std::uint32_t k = 0; k < count; ++k, byte += stride)
            loads_.push_back((static_cast<std::uint64_t>(array) << 34 | byte) / 32);
    }

    /// The top entry of the stack, of which each word lies lane by lane.
    void touch_stack(std::uint32_t words = 2) {
        for (std::uint32_t word = 0; word < words; ++word)
            loads_.push_back(kStackSector + 4 * (stack_.size() * words + word) + number_ / 8);
    }

    void end_step(StepKind kind, std::uint32_t item = 0, std::uint32_t detail = 0) {
        steps_.push_back({{round_, visit_, item, detail}, kind, std::exchange(loads_, {})});
    }

    bool meets(const Box& box, float& key) {
        return !box.empty() && hits_box(slab_, box.lower, box.upper, key) &&
               key <= last_depth(closest_.t());
    }

    /// Nodes down to a leaf, and the leaf.
    void trace_round(const Bvh& bvh) {
        for (visit_ = 0; !is_leaf(current_.child); ++visit_) visit_node(bvh.nodes[current_.child]);
        visit_ = kLeafVisit;
        if (!is_finished()) visit_leaf(bvh.leaves[leaf_of(current_.child)]);
    }

    void visit_node(const Node& node) {
        const std::uint64_t index = current_.child;
        current_ = {kEmptyChild, kInfiniteT};
        boxes_ += 4;
        load(Array::kNodeBoxes, 96 * index, 6);
        end_step(StepKind::kNode);
        std::uint32_t item = 0;
        for (std::uint32_t first = 0; first < kWidth; first += 4) {
            Box quarter;
            float key;
            for (std::uint32_t k = 0; k < 4; ++k) quarter.extend(slot_box(node, first + k));
            if (!meets(quarter, key)) continue;
            boxes_ += 4;
            load(Array::kNodes, sizeof(Node) * index + 4 * first, 7, 4 * kPlaneStride);
            end_step(StepKind::kQuarter, ++item);
            for (std::uint32_t k = 0; k < 4; ++k) {
                if (!meets(slot_box(node, first + k), key)) continue;
                touch_stack();
                end_step(StepKind::kPush, item, 1 + k);
                go_to_nearer({child_of(node, first + k), key});
            }
        }
        if (is_finished()) pop();
    }

    void go_to_nearer(Entry child) {
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
            if (stack_.back().key <= last_depth(closest_.t())) current_ = stack_.back();
            stack_.pop_back();
        } while (is_finished() && !stack_.empty());
    }

    void visit_leaf(const Leaf& leaf) {
        const std::uint64_t index = leaf_of(current_.child);
        const std::uint64_t at = sizeof(Leaf) * index;
        load(Array::kLeaves, at);
        end_step(StepKind::kLeaf);
        std::array<Box, 4> groups;
        std::uint32_t count = 0;
        cpu::for_each_triangle(leaf, [&](vec3 a, vec3 b, vec3 c, std::uint32_t) {
            for (const vec3 corner : {a, b, c}) groups[count / 4].extend(corner);
            ++count;
        });
        std::array<bool, 4> is_met = {true, true, true, true};
        if (count > 4) {
            boxes_ += 4;
            load(Array::kLeafBoxes, 96 * index, 6);
            end_step(StepKind::kGroups, 0, 1);
            float key;
            for (std::size_t k = 0; k < 4; ++k) is_met[k] = meets(padded(groups[k]), key);
        }
        std::uint32_t slot = 0;
        std::uint32_t tests = 0;
        cpu::for_each_triangle(leaf, [&](vec3 a, vec3 b, vec3 c, std::uint32_t prim) {
            const std::uint32_t corners = leaf.vertex[slot].corners;
            const std::uint32_t own = slot++;
            if (!is_met[own / 4]) return;
            load(Array::kLeaves, at + 16 * own);
            for (std::uint32_t k = 0; k < 3; ++k)
                load(Array::kLeaves, at + 16 * corner(corners, k));
            end_step(StepKind::kTriangle, ++tests);
            if (!may_hit_triangle(sheared_, a, b, c)) return;
            open_ += is_open(a, b, c) ? 1 : 0;
            closest_.test(a, b, c, prim);
            end_step(StepKind::kHit, tests, 1);
        });
        if (any_hit_ && has_hit()) stack_.clear();
        pop();
    }

    /// Whether plain floats leave to `decide` if and where a triangle is hit.
    bool is_open(vec3 a, vec3 b, vec3 c) const {
        for (vec3* const p : {&a, &b, &c}) *p = project_fast(sheared_, *p);
        const Edges edges = fast_edges(a, b, c);
        TriangleHit hit;
        weighted_hit(sheared_, edges, a.z, b.z, c.z, hit);
        return !surely_inside(sheared_, edges) || edges.depth_range >= edges.depth_size ||
               (is_rough(hit) && may_be_in_range(hit, ray_.tnear, closest_.t()));
    }

    /// A node, or the triangles of a leaf, which an index finds.
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
            closest_.test(t.a, t.b, t.c, t.prim_id);
        }
        current_ = {kEmptyChild, kInfiniteT};
        const std::size_t size = stack_.size();
        for (std::uint32_t k = 0; node.count == 0 && k < 2; ++k) {
            const PeerNode& child = tree.nodes[node.first + k];
            float key;
            ++boxes_;
            if (meets({child.lower, child.upper}, key)) go_to_nearer({node.first + k, key});
        }
        if (stack_.size() > size) {
            touch_stack(1);
            end_step(StepKind::kPush, kAfterTriangles);
        }
        if (!is_finished()) return;
        touch_stack(1);
        end_step(StepKind::kPop, kAfterAll);
        if (stack_.empty() || (any_hit_ && has_hit())) return;
        current_ = stack_.back();
        stack_.pop_back();
    }

    Ray ray_;
    std::size_t number_;
    bool any_hit_;
    SlabRay slab_ = slab_ray(ray_.org, ray_.dir);
    ShearedRay sheared_ = shear_ray(ray_.org, ray_.dir);
    cpu::ClosestHit closest_{ray_};
    Entry current_;
    std::vector<Entry> stack_;
    // Where it is in the outer loops.
    std::uint32_t round_ = 0, visit_ = 0;
    std::uint32_t boxes_ = 0, open_ = 0;
    std::vector<LaneStep> steps_;
    /// Sectors of the step that has not ended.
    std::vector<std::uint64_t> loads_;
};

}  // namespace

template <class Tree>
WarpTrace trace_warp(const Tree& tree, std::span<const Ray> rays, bool any_hit) {
    WarpTrace trace;
    std::vector<LaneStep> steps;
    for (std::size_t i = 0; i < rays.size(); ++i)
        Lane(rays[i], i, any_hit).trace(tree, trace, steps);
    std::ranges::stable_sort(steps, {}, &LaneStep::turn);
    for (std::size_t begin = 0, end = 0; begin < steps.size(); begin = end) {
        while (end < steps.size() && steps[end].turn == steps[begin].turn) ++end;
        trace.steps.push_back(warp_step({&steps[begin], end - begin}));
    }
    return trace;
}

template WarpTrace trace_warp(const Bvh&, std::span<const Ray>, bool);
template WarpTrace trace_warp(const PeerTree&, std::span<const Ray>, bool);

}  // namespace mray::lab
