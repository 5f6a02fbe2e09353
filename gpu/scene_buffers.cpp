#include "gpu/scene_buffers.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace mray::gpu {
namespace {

constexpr VkFormat kWord = VK_FORMAT_R32_UINT;
constexpr VkFormat kFourWords = VK_FORMAT_R32G32B32A32_UINT;
constexpr VkBufferUsageFlags kRead = VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;
constexpr VkBufferUsageFlags kReadInPlace = VK_BUFFER_USAGE_STORAGE_TEXEL_BUFFER_BIT;
constexpr VkBufferUsageFlags kRefitted = kRead | kReadInPlace;

/// The bytes of a contiguous container.
template <class Values>
std::span<const std::byte> bytes_of(const Values& values) {
    return std::as_bytes(std::span(values));
}

/// A texel buffer with these values, and with room for the part `room` of their size more.
template <class Values>
TexelBuffer filled(Context& context, Transfer& transfer, const char* name, const Values& values,
                   VkFormat format = kWord, VkBufferUsageFlags usage = kRead, double room = 0) {
    const std::size_t size = bytes_of(values).size();
    const auto more = static_cast<std::size_t>(static_cast<double>(size) * room) / 16 * 16;
    TexelBuffer texels(context, name, size + more, format, usage);
    transfer.upload(bytes_of(values), texels.buffer);
    return texels;
}

/// Three vertices and the albedo of each triangle; a single triangle of vertex 0 if there are none,
/// since lanes without a hit read the first triangle.
std::vector<uvec4> with_albedo(const Topology& topology) {
    std::vector<uvec4> texels(std::max<std::size_t>(topology.triangles.size(), 1), uvec4(0));
    for (std::size_t i = 0; i < topology.triangles.size(); ++i) {
        texels[i] = uvec4(topology.triangles[i], topology.albedo[i]);
    }
    return texels;
}

/// The leaves of a tree; a single leaf of zeros if there are none, for lanes without a leaf.
const AlignedVector<Leaf>& leaves_of(const Bvh& bvh) {
    static const AlignedVector<Leaf> kNone(1, Leaf{});
    return bvh.leaves.empty() ? kNone : bvh.leaves;
}

}  // namespace

Bvh empty_tree() {
    Bvh bvh;
    Node& root = bvh.nodes.emplace_back();
    for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
        root.lower_x[slot] = root.lower_y[slot] = root.lower_z[slot] = kEmptyPlane;
        root.upper_x[slot] = root.upper_y[slot] = root.upper_z[slot] = -kEmptyPlane;
        root.child[slot] = kEmptyChild;
    }
    bvh.node_parents = {kNoParent};
    bvh.level_begin = {0, 1};
    return bvh;
}

SceneBuffers::SceneBuffers(Context& context, Transfer& transfer, const Topology& topology,
                           std::span<const vec3> positions, const Bvh& bvh)
    : vertex_count_(topology.vertex_count),
      triangle_count_(static_cast<std::uint32_t>(topology.triangles.size())),
      positions_(context, "positions", kPaddedBytes * positions.size(), kFourWords, kRefitted),
      triangles_(
          filled(context, transfer, "triangles", with_albedo(topology), kFourWords, kReadInPlace)),
      tree_(context, transfer, bvh, 0) {
    set_positions(transfer, positions);
}

SceneBuffers::Tree::Tree(Context& context, Transfer& transfer, const Bvh& bvh, double room)
    : leaf_count(static_cast<std::uint32_t>(bvh.leaves.size())),
      level_begin(bvh.level_begin),
      nodes(filled(context, transfer, "nodes", bvh.nodes, kFourWords, kRefitted, room)),
      leaves(filled(context, transfer, "leaves", leaves_of(bvh), kFourWords, kReadInPlace, room)),
      leaf_vertices(
          filled(context, transfer, "leaf vertices", bvh.leaf_vertices, kFourWords, kRead, room)),
      leaf_parents(filled(context, transfer, "leaf parents", bvh.leaf_parents, kWord, kRead, room)),
      node_parents(filled(context, transfer, "node parents", bvh.node_parents, kWord, kRead, room)),
      repeated(bvh.repeated),
      repeated_texels(filled(context, transfer, "repeated triangles", bvh.repeated)),
      nodes_out(texel_view(context, "nodes, written", nodes.buffer, kWord)),
      leaves_out(texel_view(context, "leaves, written", leaves.buffer, kWord)) {
    assert(level_begin.back() == bvh.nodes.size());
}

void SceneBuffers::set_positions(Transfer& transfer, std::span<const vec3> positions) {
    assert(positions.size() == vertex_count_);
    transfer.upload_padded(positions, positions_.buffer);
}

Record SceneBuffers::set_positions(Context& context, std::span<const vec3> positions,
                                   std::span<const IndexRange> ranges) {
    assert(positions.size() == vertex_count_);
    if (ranges.empty()) return {};
    const bool is_staged = positions_.buffer.mapped().empty();
    if (is_staged && staged_positions_.get() == VK_NULL_HANDLE) {
        staged_positions_ =
            Buffer(context, "staged positions", kPaddedBytes * vertex_count_, 0, Memory::kHost);
    }
    const Buffer& written = is_staged ? staged_positions_ : positions_.buffer;
    std::vector<VkBufferCopy> copies;
    for (const IndexRange range : ranges) {
        const std::size_t count = range.end - range.begin;
        const VkDeviceSize begin = kPaddedBytes * range.begin;
        const VkDeviceSize size = kPaddedBytes * count;
        write_padded(positions.subspan(range.begin, count), written.mapped().subspan(begin, size));
        copies.push_back({.srcOffset = begin, .dstOffset = begin, .size = size});
    }
    if (!is_staged) return {};
    return [copies = std::move(copies), from = written.get(),
            to = positions_.buffer.get()](VkCommandBuffer commands) {
        vkCmdCopyBuffer(commands, from, to, static_cast<std::uint32_t>(copies.size()),
                        copies.data());
        // Writer: the copy; reader: kernels.
        barrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_READ_BIT);
    };
}

void SceneBuffers::set_tree(Context& context, Transfer& transfer, const Bvh& bvh, double room) {
    assert(bvh.triangle_count == triangle_count_);
    tree_ = Tree(context, transfer, bvh, room);
}

std::optional<std::uint64_t> SceneBuffers::change_tree(Transfer& transfer, const Bvh& before,
                                                       const Bvh& after) {
    assert(before.nodes.size() == node_count() && before.leaves.size() == leaf_count());
    std::uint64_t written = 0;
    bool has_room = true;
    const auto for_each_part = [&](auto use) {
        use(before.nodes, after.nodes, tree_.nodes);
        use(before.leaves, after.leaves, tree_.leaves);
        use(before.leaf_vertices, after.leaf_vertices, tree_.leaf_vertices);
        use(before.leaf_parents, after.leaf_parents, tree_.leaf_parents);
        use(before.node_parents, after.node_parents, tree_.node_parents);
    };
    for_each_part([&](const auto&, const auto& values, const TexelBuffer& texels) {
        has_room = has_room && bytes_of(values).size() <= texels.buffer.size();
    });
    if (!has_room || after.repeated != tree_.repeated) return std::nullopt;
    for_each_part([&](const auto& old_values, const auto& values, const TexelBuffer& texels) {
        written += transfer.upload_changes(bytes_of(old_values), bytes_of(values), texels.buffer);
    });
    tree_.level_begin = after.level_begin;
    tree_.leaf_count = static_cast<std::uint32_t>(after.leaves.size());
    return written;
}

std::uint64_t SceneBuffers::tree_bytes() const {
    return sizeof(Node) * node_count() + sizeof(Leaf) * leaf_count() +
           4 * (node_count() + (kLeafVertices + 1) * std::uint64_t{leaf_count()});
}

void SceneBuffers::read_tree(Transfer& transfer, Bvh& bvh) const {
    assert(bvh.nodes.size() == node_count() && bvh.leaves.size() == leaf_count());
    transfer.download(tree_.nodes.buffer, std::as_writable_bytes(std::span(bvh.nodes)));
    transfer.download(tree_.leaves.buffer, std::as_writable_bytes(std::span(bvh.leaves)));
}

std::span<const Node> SceneBuffers::nodes(Transfer& transfer, AlignedVector<Node>& copy) const {
    const std::span<const std::byte> mapped = tree_.nodes.buffer.mapped();
    if (!mapped.empty()) return {reinterpret_cast<const Node*>(mapped.data()), node_count()};
    copy.resize(node_count());
    transfer.download(tree_.nodes.buffer, std::as_writable_bytes(std::span(copy)));
    return copy;
}

void SceneBuffers::add_to(Bindings& bindings) const {
    bindings.views[kBindPositions] = positions_.view.get();
    bindings.views[kBindTriangles] = triangles_.view.get();
    bindings.views[kBindNodes] = tree_.nodes.view.get();
    bindings.views[kBindRefittedNodes] = tree_.nodes.view.get();
    bindings.views[kBindPose] = positions_.view.get();
    bindings.views[kBindLeaves] = tree_.leaves.view.get();
    bindings.views[kBindLeafVertices] = tree_.leaf_vertices.view.get();
    bindings.views[kBindLeafParents] = tree_.leaf_parents.view.get();
    bindings.views[kBindNodeParents] = tree_.node_parents.view.get();
    bindings.views[kBindRepeated] = tree_.repeated_texels.view.get();
    bindings.views[kBindNodesOut] = tree_.nodes_out.get();
    bindings.views[kBindLeavesOut] = tree_.leaves_out.get();
}

}  // namespace mray::gpu
