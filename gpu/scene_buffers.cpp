#include "gpu/scene_buffers.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <utility>

namespace mray::gpu {
namespace {

constexpr VkFormat kWord = VK_FORMAT_R32_UINT;
constexpr VkFormat kFourWords = VK_FORMAT_R32G32B32A32_UINT;
constexpr VkBufferUsageFlags kSampled = VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;
constexpr VkBufferUsageFlags kInPlace = VK_BUFFER_USAGE_STORAGE_TEXEL_BUFFER_BIT;

template <class Values>
std::span<const std::byte> bytes_of(const Values& values) {
    return std::as_bytes(std::span(values));
}

/// Makes buffers with values in them.
struct Filler {
    Device& device;
    BufferKind kind;
    Transfer& transfer;

    template <class Values>
    ReadBuffer operator()(const char* name, const Values& values, VkFormat format = kWord,
                          VkBufferUsageFlags texels = kSampled) const {
        ReadBuffer buffer(device, kind, name, bytes_of(values).size(), format, 0, texels);
        transfer.upload(bytes_of(values), buffer.buffer);
        return buffer;
    }
};

/// Texels hold a vertex each; storage buffers have no gaps.
std::size_t bytes_of_vertex(BufferKind kind) {
    return kind == BufferKind::kTexels ? sizeof(vec4) : sizeof(vec3);
}

void write_positions(BufferKind kind, std::span<const vec3> positions, std::span<std::byte> out) {
    if (kind == BufferKind::kTexels) {
        std::byte* to = out.data();
        for (const vec3& position : positions) {
            const vec4 padded(position, 0.0f);
            std::memcpy(to, &padded, sizeof padded);
            to += sizeof padded;
        }
        return;
    }
    // One thread would take longer than the bus.
    constexpr std::size_t kGrain = std::size_t{1} << 18;
    const std::span<const std::byte> bytes = std::as_bytes(positions);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bytes.size(), kGrain),
                      [&](const tbb::blocked_range<std::size_t>& part) {
                          std::memcpy(out.data() + part.begin(), bytes.data() + part.begin(),
                                      part.size());
                      });
}

UniqueBufferView words_of(Device& device, BufferKind kind, const Buffer& buffer) {
    if (kind == BufferKind::kStorage) return {};
    return texel_view(device, buffer, kWord);
}

/// Vertices and albedo of each triangle, at least one: lanes without a hit read the first.
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

SceneBuffers::SceneBuffers(Device& device, BufferKind kind, Transfer& transfer,
                           const Topology& topology, std::span<const vec3> positions,
                           const Bvh& bvh)
    : device_(&device),
      kind_(kind),
      vertex_count_(topology.vertex_count),
      triangle_count_(static_cast<std::uint32_t>(topology.triangles.size())),
      positions_(device, kind, "positions", bytes_of_vertex(kind) * positions.size(), kFourWords),
      triangles_(Filler{device, kind, transfer}("triangles", with_albedo(topology), kFourWords)),
      tree_(device, kind, transfer, bvh) {
    set_positions(transfer, positions);
}

SceneBuffers::Tree::Tree(Device& device, BufferKind kind, Transfer& transfer, const Bvh& bvh)
    : leaf_count(static_cast<std::uint32_t>(bvh.leaves.size())), level_begin(bvh.level_begin) {
    assert(level_begin.back() == bvh.nodes.size());
    const Filler filled{device, kind, transfer};
    nodes = filled("nodes", bvh.nodes, kFourWords, kInPlace);
    leaves = filled("leaves", leaves_of(bvh), kFourWords, kInPlace);
    const auto boxes_of = [&](const char* name, std::uint64_t size, std::uint64_t part) {
        return ReadBuffer(device, kind, name, size / part * 16 * kQuarterVec4s, kFourWords, 0,
                          kInPlace);
    };
    quarters = boxes_of("quarters of nodes", nodes.buffer.size(), sizeof(Node));
    groups = boxes_of("groups of triangles", leaves.buffer.size(), sizeof(Leaf));
    leaf_vertices = filled("leaf vertices", bvh.leaf_vertices);
    leaf_parents = filled("leaf parents", bvh.leaf_parents);
    node_parents = filled("node parents", bvh.node_parents);
    repeated = bvh.repeated;
    repeated_texels = filled("repeated triangles", bvh.repeated);
    node_words = words_of(device, kind, nodes.buffer);
    leaf_words = words_of(device, kind, leaves.buffer);
    quarter_words = words_of(device, kind, quarters.buffer);
    group_words = words_of(device, kind, groups.buffer);
}

void SceneBuffers::set_positions(Transfer& transfer, std::span<const vec3> positions) {
    if (positions.empty()) return;
    const IndexRange all[] = {{0, vertex_count_}};
    transfer.run(set_positions(positions, all));
}

Record SceneBuffers::set_positions(std::span<const vec3> positions,
                                   std::span<const IndexRange> ranges) {
    assert(positions.size() == vertex_count_);
    if (ranges.empty()) return {};
    const std::size_t vertex_bytes = bytes_of_vertex(kind_);
    const bool is_staged = positions_.buffer.mapped().empty();
    if (is_staged && staged_positions_.get() == VK_NULL_HANDLE) {
        staged_positions_ =
            Buffer(*device_, "staged positions", vertex_bytes * vertex_count_, 0, Memory::kHost);
    }
    const Buffer& written = is_staged ? staged_positions_ : positions_.buffer;
    std::vector<VkBufferCopy> copies;
    for (const IndexRange range : ranges) {
        const std::size_t count = range.end - range.begin;
        const VkDeviceSize begin = vertex_bytes * range.begin;
        const VkDeviceSize size = vertex_bytes * count;
        write_positions(kind_, positions.subspan(range.begin, count),
                        written.mapped().subspan(begin, size));
        copies.push_back({.srcOffset = begin, .dstOffset = begin, .size = size});
    }
    if (!is_staged) return {};
    return [copies = std::move(copies), from = written.get(),
            to = positions_.buffer.get()](VkCommandBuffer commands) {
        vkCmdCopyBuffer(commands, from, to, static_cast<std::uint32_t>(copies.size()),
                        copies.data());
        // Writer: the copy; reader: kernels.
        barrier(commands);
    };
}

void SceneBuffers::set_tree(Transfer& transfer, const Bvh& bvh) {
    assert(bvh.triangle_count == triangle_count_);
    tree_ = Tree(*device_, kind_, transfer, bvh);
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
    positions_.bind(bindings, kBindPositions);
    triangles_.bind(bindings, kBindTriangles);
    tree_.nodes.bind(bindings, kBindNodes);
    tree_.leaves.bind(bindings, kBindLeaves);
    tree_.leaf_vertices.bind(bindings, kBindLeafVertices);
    tree_.leaf_parents.bind(bindings, kBindLeafParents);
    tree_.node_parents.bind(bindings, kBindNodeParents);
    tree_.repeated_texels.bind(bindings, kBindRepeated);
    tree_.nodes.bind(bindings, kBindNodeWords);
    bindings.views[kBindNodeWords] = tree_.node_words.get();
    tree_.leaves.bind(bindings, kBindLeafWords);
    bindings.views[kBindLeafWords] = tree_.leaf_words.get();
    tree_.quarters.bind(bindings, kBindQuarters);
    tree_.groups.bind(bindings, kBindGroups);
    tree_.quarters.bind(bindings, kBindQuarterWords);
    bindings.views[kBindQuarterWords] = tree_.quarter_words.get();
    tree_.groups.bind(bindings, kBindGroupWords);
    bindings.views[kBindGroupWords] = tree_.group_words.get();
}

}  // namespace mray::gpu
