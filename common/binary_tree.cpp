#include "common/binary_tree.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>

#include "common/split.h"

namespace morphray {
namespace {

// Below this depth only the median divides, so that 2^28 triangles end within kMaxBinaryHeight:
// from 36 on at most 26 halvings lead from 2^28 to the 5 triangles that fit any meshlet.
constexpr std::uint32_t kMedianDepth = 36;
static_assert(kMedianDepth + 28 <= kMaxBinaryHeight);

// A set of this size or more is worth another task.
constexpr std::size_t kTaskSize = 4096;

// Up to here every position is cheap enough to try even when binning.
constexpr std::size_t kSweepSize = 128;

class Builder {
public:
    Builder(const Topology& topology, SplitMethod method, std::vector<PrimRef>& refs)
        : topology_(topology), method_(method), refs_(refs), slots_(2 * refs.size()) {}

    /// Builds the subtree of refs[begin .. end) into slots [slot .. slot + 2 * (end - begin) - 1):
    /// a place that its size alone determines, so that tasks need no lock and the result no luck.
    void build(std::uint32_t slot, std::uint32_t begin, std::uint32_t end, std::uint32_t depth) {
        BinaryNode& node = slots_[slot];
        node = BinaryNode{.box = {}, .begin = begin, .end = end, .right = 0, .height = 0};
        const std::span<PrimRef> refs(refs_.data() + begin, end - begin);
        if (fits_leaf(refs)) {
            for (const PrimRef& ref : refs) node.box.extend(ref.box());
            return;
        }
        const auto left_size = static_cast<std::uint32_t>(split(refs, depth));
        const std::uint32_t left = slot + 1;
        const std::uint32_t right = slot + 2 * left_size;
        const auto build_left = [=, this] { build(left, begin, begin + left_size, depth + 1); };
        const auto build_right = [=, this] { build(right, begin + left_size, end, depth + 1); };
        if (refs.size() >= kTaskSize) {
            tbb::parallel_invoke(build_left, build_right);
        } else {
            build_left();
            build_right();
        }
        node.box = slots_[left].box;
        node.box.extend(slots_[right].box);
        node.right = right;
        node.height = 1 + std::max(slots_[left].height, slots_[right].height);
    }

    /// The nodes without the gaps between them, in preorder.
    std::vector<BinaryNode> compact() const {
        std::vector<BinaryNode> nodes;
        append(0, nodes);
        return nodes;
    }

private:
    std::size_t split(std::span<PrimRef> refs, std::uint32_t depth) const {
        std::size_t left_size = 0;
        if (depth < kMedianDepth) {
            const bool sweep = method_ == SplitMethod::kSweep || refs.size() <= kSweepSize;
            left_size = sweep ? split_sweep(refs) : split_binned(refs);
        }
        return left_size != 0 ? left_size : split_median(refs);
    }

    bool fits_leaf(std::span<const PrimRef> refs) const {
        if (refs.size() > kLeafTriangles) return false;
        if (3 * refs.size() <= kLeafVertices) return true;
        std::array<std::uint32_t, 3 * kLeafTriangles> vertices;
        auto end = vertices.begin();
        for (const PrimRef& ref : refs) {
            const uvec3 t = topology_.triangles[ref.prim_id];
            *end++ = t.x;
            *end++ = t.y;
            *end++ = t.z;
        }
        std::sort(vertices.begin(), end);
        return std::unique(vertices.begin(), end) - vertices.begin() <=
               std::ptrdiff_t{kLeafVertices};
    }

    std::uint32_t append(std::uint32_t slot, std::vector<BinaryNode>& nodes) const {
        const auto index = static_cast<std::uint32_t>(nodes.size());
        nodes.push_back(slots_[slot]);
        if (!slots_[slot].is_leaf()) {
            append(slot + 1, nodes);
            const std::uint32_t right = append(slots_[slot].right, nodes);
            nodes[index].right = right;
        }
        return index;
    }

    const Topology& topology_;
    SplitMethod method_;
    std::vector<PrimRef>& refs_;
    std::vector<BinaryNode> slots_;
};

PrimRef make_ref(const Topology& topology, std::span<const vec3> positions, std::uint32_t prim_id) {
    const uvec3 t = topology.triangles[prim_id];
    Box box;
    for (const std::uint32_t vertex : {t.x, t.y, t.z}) {
        if (is_finite_vertex(positions[vertex])) box.extend(positions[vertex]);
    }
    return {box.lower, prim_id, box.upper, 0};
}

}  // namespace

BinaryTree build_binary_tree(const Topology& topology, std::span<const vec3> positions,
                             SplitMethod method) {
    BinaryTree tree;
    const auto count = static_cast<std::uint32_t>(topology.triangles.size());
    if (count == 0) return tree;
    tree.refs.resize(count);
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, count, kTaskSize),
                      [&](const auto& range) {
                          for (std::uint32_t i = range.begin(); i != range.end(); ++i) {
                              tree.refs[i] = make_ref(topology, positions, i);
                          }
                      });
    Builder builder(topology, method, tree.refs);
    builder.build(0, 0, count, 0);
    tree.nodes = builder.compact();
    return tree;
}

}  // namespace morphray
