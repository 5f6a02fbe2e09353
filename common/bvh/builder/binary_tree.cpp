#include "common/bvh/builder/binary_tree.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>
#include <mutex>
#include <utility>

#include "common/base/hash.h"

namespace mray {
namespace {

// Below this depth only the median divides, so that kMaxTriangles end within kMaxBinaryHeight: from
// 36 on at most 26 halvings lead from 2^28 to the 5 triangles that fit any meshlet.
constexpr std::uint32_t kMedianDepth = 36;
static_assert(kMaxTriangles <= std::uint64_t{1} << (kMaxBinaryHeight - kMedianDepth));

constexpr std::size_t kTaskSize = 2048;

// Up to here every position is tried. More gains nothing (lab/notes/build_and_refit.md).
constexpr std::size_t kSweepSize = 24;
static_assert(kSweepSize <= kFewRefs);

// Nodes that a thread takes: with one pair, threads would write to the same cache lines.
constexpr std::uint32_t kNodeBlock = 128;

/// Removes refs to triangles that have the three vertices of an earlier one of the set, in the same
/// order, and appends them to `repeated`: they move together, so that one may stand for all. The
/// others keep their order; returns how many they are. refs ascend by prim_id, and all are
/// triangles. Takes at most 256 KiB more; beyond some ten thousand triangles it may leave some.
std::size_t remove_repeated(const Topology& topology, std::span<PrimRef> refs,
                            std::vector<RepeatedTriangle>& repeated) {
    constexpr std::size_t kMostPlaces = std::size_t{1} << 16;
    constexpr std::uint32_t kNone = 0xFFFFFFFFu;
    // For each hash the last triangle that was kept with it.
    std::vector<std::uint32_t> kept(std::min(std::bit_ceil(2 * refs.size()), kMostPlaces), kNone);
    std::size_t count = 0;
    for (const PrimRef& ref : refs) {
        const uvec3& triangle = topology.triangles[ref.prim_id()];
        std::uint32_t& place = kept[hash_of(triangle) & (kept.size() - 1)];
        if (place != kNone && topology.triangles[place] == triangle) {
            repeated.push_back({place, ref.prim_id()});
            continue;
        }
        place = ref.prim_id();
        refs[count++] = ref;
    }
    return count;
}

class Builder {
public:
    /// Every split moves the refs from one of the two arrays to the other.
    Builder(const Topology& topology, const SimdTarget& target, const Watch& watch,
            BinaryTree& tree)
        : topology_(topology),
          target_(target),
          watch_(watch),
          tree_(tree),
          refs_{tree.refs.data(), nullptr} {
        const std::size_t count = tree.refs.size();
        tree.spare.resize((count * sizeof(PrimRef) + sizeof(Leaf) - 1) / sizeof(Leaf));
        refs_[1] = new (tree.spare.data()) PrimRef[count];
        tree_.prim_ids.resize(count);
        // The root, two for each split, and the unused rest of each thread's last block.
        blocks_.resize(static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()));
        tree_.nodes.resize(2 * count + blocks_.size() * kNodeBlock);
    }

    void build() { build(0, 0, static_cast<std::uint32_t>(tree_.prim_ids.size()), 0, nullptr); }

    std::uint32_t node_count() const { return node_count_; }

private:
    /// The unused rest of the nodes that a thread has taken.
    struct alignas(64) NodeBlock {
        std::uint32_t next = 0;
        std::uint32_t end = 0;
    };

    /// Builds the subtree of refs_[depth % 2][begin .. end). block: the calling thread's if that
    /// builds the whole subtree, otherwise null. coincide: whether all centroids are known to
    /// coincide, and repeated triangles are removed.
    void build(std::uint32_t node_index, std::uint32_t begin, std::uint32_t end,
               std::uint32_t depth, NodeBlock* block, bool coincide = false) {
        BinaryNode& node = tree_.nodes[node_index];
        node.begin = begin;
        node.end = end;
        node.children = 0;
        node.height = 0;
        const std::span<PrimRef> refs(refs_[depth % 2] + begin, end - begin);
        if (refs.size() <= kLeafTriangles && make_leaf(refs, node)) return;
        // make_leaf reads them soon, in no order (lab/notes/build_and_refit.md).
        if (refs.size() <= kSweepSize && !is_part(refs.back())) {
            for (const PrimRef& ref : refs) __builtin_prefetch(&topology_.triangles[ref.prim_id()]);
        }
        PrimRef* const out = refs_[(depth + 1) % 2] + begin;
        std::size_t left_size = 0;
        if (depth < kMedianDepth && !coincide) {
            left_size = split_by_cost(refs, out);
            coincide = left_size == 0;
            if (coincide && !is_part(refs.back())) {
                const std::size_t count = take_repeated(refs);
                if (count < refs.size()) {
                    end = begin + static_cast<std::uint32_t>(count);
                    return build(node_index, begin, end, depth, block, true);
                }
            }
        }
        if (left_size == 0) left_size = split_median(refs, out, target_);
        const auto middle = begin + static_cast<std::uint32_t>(left_size);
        std::uint32_t left;
        if (refs.size() >= kTaskSize) {
            watch_.throw_if_cancelled();
            left = take_pair(own_block());
            tbb::parallel_invoke(
                [=, this] { build(left, begin, middle, depth + 1, nullptr, coincide); },
                [=, this] { build(left + 1, middle, end, depth + 1, nullptr, coincide); });
        } else {
            if (block == nullptr) block = &own_block();
            left = take_pair(*block);
            build(left, begin, middle, depth + 1, block, coincide);
            build(left + 1, middle, end, depth + 1, block, coincide);
        }
        node.box = tree_.nodes[left].box;
        node.box.extend(tree_.nodes[left + 1].box);
        node.children = left;
        node.height = 1 + std::max(tree_.nodes[left].height, tree_.nodes[left + 1].height);
    }

    /// Removes the repeated triangles of a set; returns how many are left.
    std::size_t take_repeated(std::span<PrimRef> refs) {
        std::vector<RepeatedTriangle> repeated;
        const std::size_t count = remove_repeated(topology_, refs, repeated);
        if (repeated.empty()) return count;
        const std::scoped_lock lock(repeated_mutex_);
        tree_.repeated.insert(tree_.repeated.end(), repeated.begin(), repeated.end());
        return count;
    }

    NodeBlock& own_block() {
        const int index = tbb::this_task_arena::current_thread_index();
        return blocks_[static_cast<std::size_t>(std::max(index, 0))];
    }

    std::uint32_t take_pair(NodeBlock& block) {
        if (block.next == block.end) {
            block.next = node_count_.fetch_add(kNodeBlock, std::memory_order_relaxed);
            block.end = block.next + kNodeBlock;
        }
        block.next += 2;
        return block.next - 2;
    }

    /// Returns 0 if all centroids coincide.
    std::size_t split_by_cost(std::span<const PrimRef> refs, PrimRef* out) const {
        return refs.size() <= kSweepSize ? split_few(refs, out, target_)
                                         : split_binned(refs, out, target_);
    }

    /// Parts come after all triangles.
    bool is_part(const PrimRef& ref) const { return ref.prim_id() >= topology_.triangles.size(); }

    /// Makes the node a leaf and returns true if its triangles, or its part, fit one.
    bool make_leaf(std::span<const PrimRef> refs, BinaryNode& node) {
        if (refs.size() > 1 && is_part(refs.back())) return false;
        for (std::size_t i = 0; i < refs.size(); ++i)
            tree_.prim_ids[node.begin + i] = refs[i].prim_id();
        LeafShape shape;
        const bool has_shape = !is_part(refs.back());
        if (has_shape && !find_leaf_shape(topology_, tree_.triangles(node), shape)) return false;
        node.box = union_of(refs, target_);
        if (has_shape) tree_.set_shape(node, shape);
        return true;
    }

    const Topology& topology_;
    SimdTarget target_;
    const Watch& watch_;
    BinaryTree& tree_;
    PrimRef* refs_[2];
    std::vector<NodeBlock> blocks_;
    std::mutex repeated_mutex_;
    std::atomic<std::uint32_t> node_count_ = 1;
};

// The memory of as many refs holds a whole LeafShape, that of fewer the used part.
constexpr std::size_t kRoomy = (sizeof(LeafShape) + sizeof(PrimRef) - 1) / sizeof(PrimRef);

constexpr std::size_t kWord = sizeof(std::uint32_t);
static_assert(kWord * (1 + 1 + 3) <= sizeof(PrimRef));

}  // namespace

LeafShape BinaryTree::shape(const BinaryNode& leaf) const {
    const char* room = reinterpret_cast<const char*>(&refs[leaf.begin]);
    LeafShape shape;
    if (leaf.size() >= kRoomy) {
        std::memcpy(&shape, room, sizeof shape);
        return shape;
    }
    const std::size_t corners = kWord * leaf.size();
    std::memcpy(&shape.vertex_count, room, kWord);
    std::memcpy(shape.corners, room + kWord, corners);
    std::memcpy(shape.vertices, room + kWord + corners, kWord * shape.vertex_count);
    return shape;
}

void BinaryTree::set_shape(const BinaryNode& leaf, const LeafShape& shape) {
    char* room = reinterpret_cast<char*>(&refs[leaf.begin]);
    if (leaf.size() >= kRoomy) {
        std::memcpy(room, &shape, sizeof shape);
        return;
    }
    const std::size_t corners = kWord * leaf.size();
    std::memcpy(room, &shape.vertex_count, kWord);
    std::memcpy(room + kWord, shape.corners, corners);
    std::memcpy(room + kWord + corners, shape.vertices, kWord * shape.vertex_count);
}

BinaryTree build_binary_tree(const Topology& topology, std::span<const vec3> positions,
                             const SimdTarget& target, const Watch& watch) {
    const auto count = static_cast<std::uint32_t>(topology.triangles.size());
    AlignedVector<PrimRef> refs;
    refs.resize(count);
    using Range = tbb::blocked_range<std::uint32_t>;
    tbb::parallel_for(Range(0, count, kTaskSize), [&](const Range& range) {
        watch.throw_if_cancelled();
        make_refs(topology, positions, range.begin(),
                  std::span(refs).subspan(range.begin(), range.size()), target);
    });
    return build_binary_tree(topology, std::move(refs), target, watch);
}

BinaryTree build_binary_tree(const Topology& topology, AlignedVector<PrimRef> refs,
                             const SimdTarget& target, const Watch& watch) {
    BinaryTree tree;
    if (refs.empty()) return tree;
    tree.refs = std::move(refs);
    Builder builder(topology, target, watch, tree);
    builder.build();
    tree.nodes.resize(builder.node_count());
    return tree;
}

}  // namespace mray
