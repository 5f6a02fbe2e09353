#include "common/bvh/builder/binary_tree.h"

#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <cstring>
#include <mutex>

#include "common/base/hash.h"

namespace mray {
namespace {

// Below this depth only the median divides, so that kMaxTriangles end within kMaxBinaryHeight: from
// 36 on at most 26 halvings lead from 2^28 to the 5 triangles that fit any meshlet.
constexpr std::uint32_t kMedianDepth = 36;
static_assert(kMaxTriangles <= std::uint64_t{1} << (kMaxBinaryHeight - kMedianDepth));
constexpr std::size_t kTaskSize = 2048;
// Sets of no more triangles soon become leaves.
constexpr std::size_t kFewTriangles = 24;
// Sets of so many triangles are divided by bins only: a split by area is the work of one thread.
constexpr std::size_t kManyTriangles = 16384;
// A set that fits a leaf becomes one if both parts together have about this many times its area, or
// more. With 1.1 rooms have trees that cost 2 % more (lab/notes/build_and_refit.md).
constexpr float kMostPartArea = 1.2f;
// Nodes that a thread takes: with one pair, threads would write to the same cache lines.
constexpr std::uint32_t kNodeBlock = 128;

/// Moves triangles that have the three vertices of an earlier one of the set, in the same order, to
/// `repeated`. The others keep their order; returns their number. refs ascend by prim_id, and all
/// are triangles. Takes at most 256 KiB; beyond some ten thousand triangles it may leave some.
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
    /// tree.refs has room for a ref a triangle. Every split moves the refs from one of two arrays
    /// to the other. positions: those of the topology, or none where no pairs are made.
    Builder(const Topology& topology, std::span<const vec3> positions, const SimdTarget& target,
            const Watch& watch, BinaryTree& tree)
        : topology_(topology),
          positions_(positions),
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

    /// Builds over the refs that the tree has; with positions, over all triangles of the topology.
    void build() {
        std::span<PrimRef> refs = tree_.refs;
        if (!positions_.empty())
            refs = make_paired_refs(topology_, positions_, refs_[0], refs_[1], target_, watch_);
        if (refs.data() != refs_[0]) std::swap(refs_[0], refs_[1]);
        const auto triangle_count = static_cast<std::uint32_t>(tree_.prim_ids.size());
        build(tree_.nodes[0], {0, triangle_count, refs.size()}, 0, nullptr);
        tree_.nodes.resize(node_count_);
    }

private:
    /// The unused rest of the nodes that a thread has taken.
    struct alignas(64) NodeBlock {
        std::uint32_t next = 0;
        std::uint32_t end = 0;
    };

    /// The triangles prim_ids[begin .. end), with `refs` refs from index `begin` of an array on.
    struct Set {
        std::uint32_t begin;
        std::uint32_t end;
        std::size_t refs;
        /// An upper bound of the areas of the boxes.
        float largest = std::numeric_limits<float>::infinity();

        std::size_t size() const { return end - begin; }
    };

    /// Builds the subtree of a set of refs_[depth % 2]. block: the thread's if that builds the
    /// whole subtree, or null. coincide: all centroids coincide, and repeated triangles are
    /// removed.
    void build(BinaryNode& node, const Set& set, std::uint32_t depth, NodeBlock* block,
               bool coincide = false) {
        node.begin = set.begin;
        node.end = set.end;
        node.children = 0;
        node.height = 0;
        if (set.size() <= kLeafTriangles) {
            if (depth < kMedianDepth && has_large_triangle(refs_of(set, depth), set.largest)) {
                divide_or_keep(node, set, depth, block);
                return;
            }
            if (make_leaf(refs_of(set, depth), node)) return;
        }
        divide(node, set, depth, block, coincide);
    }

    std::span<PrimRef> refs_of(const Set& set, std::uint32_t depth) const {
        return {refs_[depth % 2] + set.begin, set.refs};
    }

    /// Divides a set that has a large triangle, and makes a leaf of it if it fits one and that
    /// costs no more: rays that miss the large triangle may visit the leaf of the others in vain.
    void divide_or_keep(BinaryNode& node, const Set& set, std::uint32_t depth, NodeBlock* block) {
        PrimRef whole[kLeafTriangles];
        std::copy_n(refs_of(set, depth).data(), set.refs, whole);
        divide(node, set, depth, block, false);
        if (!node.is_leaf() && kLeafCost * half_area(node.box) <= cost_of(node) &&
            make_leaf(std::span(whole, set.refs), node)) {
            node.children = 0;
            node.height = 0;
        }
    }

    /// True if a box has at least half the area of the union of all. largest: see Set.
    bool has_large_triangle(std::span<const PrimRef> refs, float largest) const {
        if (refs.size() == 1 || is_part(refs.back())) return false;
        const auto least = static_cast<float>(0.5 * half_area(union_of(refs, target_)));
        return largest >= least && largest_area(refs) >= least;
    }

    /// The SAH cost of the subtree, in areas of boxes.
    double cost_of(const BinaryNode& node) const {
        const double area = half_area(node.box);
        if (node.is_leaf()) return kLeafCost * area;
        return area + cost_of(tree_.nodes[node.children]) + cost_of(tree_.nodes[node.children + 1]);
    }

    /// Builds the subtrees of both parts of a set. Where dividing is not worth it, or only removes
    /// repeated triangles, the node may become a leaf.
    void divide(BinaryNode& node, Set set, std::uint32_t depth, NodeBlock* block, bool coincide) {
        const std::span<PrimRef> refs = refs_of(set, depth);
        // make_leaf reads them soon, in no order (lab/notes/build_and_refit.md).
        if (set.size() <= kFewTriangles && !is_part(refs.back())) {
            for (const PrimRef& ref : refs) __builtin_prefetch(&topology_.triangles[ref.prim_id()]);
        }
        PrimRef* const out = refs_[(depth + 1) % 2] + set.begin;
        PartSize left_size;
        if (depth < kMedianDepth && !coincide) {
            left_size = split_binned(refs, out, target_);
            if (set.size() <= kLeafTriangles && left_size.cost > most_cost_of_parts(set, refs) &&
                make_leaf(refs, node))
                return;
            // Not among parts of a tree: restructured trees then cost up to 7 % more.
            const bool may_be_mixed = set.size() < kManyTriangles && !is_part(refs.back());
            if (may_be_mixed && set.size() > kFewTriangles && left_size.refs != 0) {
                const PartSize by_area =
                    split_by_area(refs, out, set.size(), left_size, set.largest);
                if (by_area.refs != 0) left_size = by_area;
            }
            coincide = left_size.refs == 0;
            if (coincide && set.refs < set.size()) {
                open_pairs(topology_, positions_, refs.data(), set.refs, set.size(), target_);
                set.refs = set.size();
                divide(node, set, depth, block, false);
                return;
            }
            if (coincide && !is_part(refs.back())) {
                const std::size_t count = take_repeated(refs);
                if (count < set.refs) {
                    set.end = set.begin + static_cast<std::uint32_t>(count);
                    set.refs = count;
                    build(node, set, depth, block, true);
                    return;
                }
            }
        }
        if (left_size.refs == 0) left_size = split_median(refs, out, target_);
        const auto middle = set.begin + static_cast<std::uint32_t>(left_size.triangles);
        const Set left_set = {set.begin, middle, left_size.refs, set.largest};
        const Set right_set = {middle, set.end, set.refs - left_size.refs, set.largest};
        std::uint32_t left;
        if (set.size() >= kTaskSize) {
            watch_.throw_if_cancelled();
            left = take_pair(own_block());
            tbb::parallel_invoke(
                [=, this] { build(tree_.nodes[left], left_set, depth + 1, nullptr, coincide); },
                [=, this] {
                    build(tree_.nodes[left + 1], right_set, depth + 1, nullptr, coincide);
                });
        } else {
            if (block == nullptr) block = &own_block();
            left = take_pair(*block);
            build(tree_.nodes[left], left_set, depth + 1, block, coincide);
            build(tree_.nodes[left + 1], right_set, depth + 1, block, coincide);
        }
        node.box = tree_.nodes[left].box;
        node.box.extend(tree_.nodes[left + 1].box);
        node.children = left;
        node.height = 1 + std::max(tree_.nodes[left].height, tree_.nodes[left + 1].height);
    }

    /// The cost of both parts (PartSize) from which on a set that fits a leaf is not divided.
    float most_cost_of_parts(const Set& set, std::span<const PrimRef> refs) const {
        return kMostPartArea * static_cast<float>(half_area(union_of(refs, target_))) *
               (0.5f * static_cast<float>(set.size()) + kPartCost);
    }

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

    /// Parts come after all triangles.
    bool is_part(const PrimRef& ref) const { return ref.prim_id() >= topology_.triangles.size(); }

    /// Makes the node a leaf and returns true if its triangles, or its part, fit one.
    bool make_leaf(std::span<const PrimRef> refs, BinaryNode& node) {
        if (refs.size() > 1 && is_part(refs.back())) return false;
        std::uint32_t ids[kLeafTriangles];
        std::size_t count = 0;
        for (const PrimRef& ref : refs) {
            for (std::uint32_t i = 0; i < ref.triangle_count(); ++i)
                ids[count++] = ref.prim_id() + i;
        }
        LeafShape shape;
        const bool has_shape = !is_part(refs.back());
        if (has_shape && !find_leaf_shape(topology_, std::span(ids, count), shape)) return false;
        std::copy_n(ids, count, &tree_.prim_ids[node.begin]);
        node.box = union_of(refs, target_);
        if (has_shape) tree_.set_shape(node, shape);
        return true;
    }

    const Topology& topology_;
    std::span<const vec3> positions_;
    SimdTarget target_;
    const Watch& watch_;
    BinaryTree& tree_;
    PrimRef* refs_[2];
    std::vector<NodeBlock> blocks_;
    std::mutex repeated_mutex_;
    std::atomic<std::uint32_t> node_count_ = 1;
};

/// Numbers vertices in the order in which they are added first. A hash table that does not branch
/// on whether a vertex is new, which cannot be predicted.
class VertexSet {
public:
    VertexSet() { std::fill_n(slots_, kTableSize, kNoSlot); }

    std::uint32_t add(std::uint32_t vertex) {
        // Multiplicative hashing; 2^32 over the golden ratio.
        std::uint8_t& entry = slots_[(vertex * 0x9E3779B9u) >> (32 - kTableBits)];
        vertices_[size_] = vertex;
        std::uint32_t slot = std::min<std::uint32_t>(entry, size_);
        if (vertices_[slot] != vertex) [[unlikely]] {
            // The entry belongs to another vertex. The number of this one is at most size_.
            slot = 0;
            while (vertices_[slot] != vertex) ++slot;
        }
        entry = static_cast<std::uint8_t>(slot);
        size_ += slot == size_ ? 1 : 0;
        return slot;
    }
    std::span<const std::uint32_t> vertices() const { return {vertices_, size_}; }

private:
    static constexpr std::uint32_t kCapacity = 3 * kLeafTriangles;
    static constexpr std::uint8_t kNoSlot = kCapacity;
    static constexpr std::uint32_t kTableBits = 7;
    static constexpr std::uint32_t kTableSize = 1u << kTableBits;

    std::uint32_t vertices_[kCapacity + 1];
    std::uint32_t size_ = 0;
    std::uint8_t slots_[kTableSize];
};

// The memory of as many refs holds a whole LeafShape, that of fewer the used part.
constexpr std::size_t kRoomy = (sizeof(LeafShape) + sizeof(PrimRef) - 1) / sizeof(PrimRef);
constexpr std::size_t kWord = sizeof(std::uint32_t);
static_assert(kWord * (1 + 1 + 3) <= sizeof(PrimRef));

}  // namespace

BinaryTree build_binary_tree(const Topology& topology, std::span<const vec3> positions,
                             const SimdTarget& target, const Watch& watch) {
    BinaryTree tree;
    tree.refs.resize(topology.triangles.size());
    if (!tree.refs.empty()) Builder(topology, positions, target, watch, tree).build();
    return tree;
}

BinaryTree build_binary_tree(const Topology& topology, AlignedVector<PrimRef> refs,
                             const SimdTarget& target, const Watch& watch) {
    BinaryTree tree;
    tree.refs = std::move(refs);
    if (!tree.refs.empty()) Builder(topology, {}, target, watch, tree).build();
    return tree;
}

bool find_leaf_shape(const Topology& topology, std::span<const std::uint32_t> prim_ids,
                     LeafShape& shape) {
    const auto count = static_cast<std::uint32_t>(prim_ids.size());
    VertexSet set;
    for (std::uint32_t i = 0; i < count; ++i) {
        const uvec3 t = topology.triangles[prim_ids[i]];
        const std::uint32_t a = set.add(t.x);
        const std::uint32_t b = set.add(t.y);
        const std::uint32_t c = set.add(t.z);
        if (set.vertices().size() > kLeafVertices) return false;
        shape.corners[i] = pack_corners(a, b, c, count);
    }
    const std::span<const std::uint32_t> vertices = set.vertices();
    shape.vertex_count = static_cast<std::uint32_t>(vertices.size());
    std::copy(vertices.begin(), vertices.end(), shape.vertices);
    return true;
}

void fill_leaf(const LeafShape& shape, std::span<const std::uint32_t> prim_ids,
               std::span<const vec3> positions, Leaf& leaf, std::uint32_t* leaf_vertices) {
    const auto count = static_cast<std::uint32_t>(prim_ids.size());
    for (std::uint32_t i = 0; i < kLeafTriangles; ++i) {
        const bool used = i < count;
        leaf.prim_id[i] = used ? prim_ids[i] : kNoPrim;
        leaf.vertex[i].corners = used ? shape.corners[i] : pack_corners(0, 0, 0, count);
    }
    for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot) {
        const std::uint32_t vertex = shape.vertices[slot < shape.vertex_count ? slot : 0];
        leaf_vertices[slot] = vertex;
        leaf.vertex[slot].x = positions[vertex].x;
        leaf.vertex[slot].y = positions[vertex].y;
        leaf.vertex[slot].z = positions[vertex].z;
    }
}

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

}  // namespace mray
