#include "gpu/scene_buffers.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cassert>
#include <cstring>

#include "common/bvh/box.h"

namespace mray::gpu {
namespace {

constexpr VkFormat kWord = VK_FORMAT_R32_UINT;
constexpr VkFormat kFourWords = VK_FORMAT_R32G32B32A32_UINT;

/// Returns a function that makes a buffer of values.
auto filler(Device& device, BufferKind kind, Transfer& transfer) {
    return [&, kind](const char* name, const auto& values, VkFormat format = kWord,
                     bool is_written = false) {
        const auto bytes = std::as_bytes(std::span(values));
        ReadBuffer buffer(device, kind, name, bytes.size(), format, 0, is_written);
        transfer.upload(bytes, buffer.buffer);
        return buffer;
    };
}

/// A texel holds a vertex; storage buffers have no gaps.
std::size_t bytes_of_vertex(BufferKind kind) {
    return kind == BufferKind::kTexels ? sizeof(vec4) : sizeof(vec3);
}

/// Threes of words, such as positions.
template <class Three>
void write_threes(BufferKind kind, std::span<const Three> threes, std::span<std::byte> out) {
    if (kind == BufferKind::kTexels) {
        std::byte* to = out.data();
        for (const Three& three : threes) {
            const glm::vec<4, typename Three::value_type> padded(three, 0);
            std::memcpy(to, &padded, sizeof padded);
            to += sizeof padded;
        }
        return;
    }
    // One thread would take longer than the bus.
    constexpr std::size_t kGrain = std::size_t{1} << 18;
    const std::span<const std::byte> bytes = std::as_bytes(threes);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bytes.size(), kGrain),
                      [&](const tbb::blocked_range<std::size_t>& part) {
                          std::memcpy(out.data() + part.begin(), bytes.data() + part.begin(),
                                      part.size());
                      });
}

/// Vertices and albedo of each triangle; one of zeros if there are none, for lanes without a hit.
std::vector<uvec4> with_albedo(const Topology& topology) {
    std::vector<uvec4> texels(std::max<std::size_t>(topology.triangles.size(), 1), uvec4(0));
    for (std::size_t i = 0; i < topology.triangles.size(); ++i)
        texels[i] = uvec4(topology.triangles[i], topology.albedo[i]);
    return texels;
}

struct BodyRecord {
    Transform transform;
    /// Centre and scale.
    vec4 space;
    /// The first vertex, the end of its vertices, the first workgroup.
    uvec4 range;
};
static_assert(sizeof(BodyRecord) == 16 * kBodyVec4s);

std::uint32_t groups_of_body(const Body& body) {
    return (body.end_vertex() - body.first_vertex + kBodyGroupVertices - 1) / kBodyGroupVertices;
}

/// The leaves of a tree; a single leaf of zeros if there are none, for lanes without a leaf.
const AlignedVector<Leaf>& leaves_of(const Bvh& bvh) {
    static const AlignedVector<Leaf> kNone(1, Leaf{});
    return bvh.leaves.empty() ? kNone : bvh.leaves;
}

// Dispatches of 2^22 leaves or nodes stay short.
constexpr std::uint32_t kMaxGroups = 1u << 20;
constexpr std::uint32_t kItemsOfGroup = kGroupSize / kRefitLanes;
// A dispatch or a copy takes 10 to 65 us on lavapipe, as long as the refit of some thousand leaves.
// So ranges are few, and gaps between them are filled.
constexpr std::size_t kMostRanges = 8;

/// Vertices that moved, in blocks that are not within a body.
std::vector<IndexRange> moved_vertices(const Pose& pose, std::span<const Body> bodies) {
    const auto count = static_cast<std::uint32_t>(pose.positions().size());
    std::vector<std::uint32_t> blocks = pose.moved_blocks();
    auto body = bodies.begin();
    std::erase_if(blocks, [&](std::uint32_t block) {
        const std::uint32_t end = std::min((block + 1) * kMotionBlock, count);
        while (body != bodies.end() && body->end_vertex() < end) ++body;
        return body != bodies.end() && body->first_vertex <= block * kMotionBlock;
    });
    // Each body parts its neighbours.
    std::vector<IndexRange> ranges = covering_ranges(blocks, kMostRanges + bodies.size());
    for (IndexRange& range : ranges)
        range = {range.begin * kMotionBlock, std::min(range.end * kMotionBlock, count)};
    return ranges;
}

struct RefitDispatch {
    const Kernel* kernel;
    RefitArguments arguments;
};

/// The dispatches of a plan in their order: leaves, then nodes level by level, the lowest first.
std::vector<RefitDispatch> dispatches_of(const Context& context, const Kernels& kernels,
                                         const SceneBuffers& scene, const RefitPlan& plan) {
    std::vector<RefitDispatch> dispatches;
    if (plan.leaf_count == 0) return dispatches;
    const std::uint32_t most =
        kItemsOfGroup * std::min(context.physical().limits.maxComputeWorkGroupCount[0], kMaxGroups);
    const auto add = [&](const Kernel& kernel, IndexRange range) {
        for (std::uint32_t first = range.begin; first < range.end; first += most)
            dispatches.push_back({&kernel, {first, std::min(range.end - first, most)}});
    };
    if (plan.all) add(kernels.refit_leaves, {0, scene.leaf_count()});
    for (const IndexRange range : covering_ranges(plan.parts.leaves, kMostRanges))
        add(kernels.refit_leaves, range);
    const std::vector<std::uint32_t>& levels = scene.level_begin();
    const std::vector<std::uint32_t>& moved = plan.parts.nodes;
    for (std::size_t level = levels.size() - 2; level > 0; --level) {
        IndexRange range = {levels[level], levels[level + 1]};
        if (!plan.all) {
            const auto first = std::ranges::lower_bound(moved, range.begin);
            const auto last = std::ranges::lower_bound(moved, range.end);
            if (first == last) continue;
            range = {*first, *(last - 1) + 1};
        }
        add(kernels.refit_nodes, range);
    }
    // The root has no parent, but quarters.
    add(kernels.refit_nodes, {0, 1});
    return dispatches;
}

}  // namespace

Bvh empty_tree() {
    Bvh bvh;
    clear_slots(bvh.nodes.emplace_back(), 0);
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
      positions_(device, kind, "positions", bytes_of_vertex(kind) * positions.size(), kFourWords,
                 kind == BufferKind::kTexels ? VK_BUFFER_USAGE_STORAGE_TEXEL_BUFFER_BIT : 0),
      triangles_(filler(device, kind, transfer)("triangles", with_albedo(topology), kFourWords)),
      tree_(device, kind, transfer, bvh) {
    set_positions(transfer, positions);
}

SceneBuffers::Tree::Tree(Device& device, BufferKind kind, Transfer& transfer, const Bvh& bvh)
    : leaf_count(static_cast<std::uint32_t>(bvh.leaves.size())), level_begin(bvh.level_begin) {
    assert(level_begin.back() == bvh.nodes.size());
    const auto filled = filler(device, kind, transfer);
    nodes = filled("nodes", bvh.nodes, kFourWords, true);
    leaves = filled("leaves", leaves_of(bvh), kFourWords, true);
    const auto boxes_of = [&](const char* name, std::uint64_t size, std::uint64_t item) {
        return ReadBuffer(device, kind, name, size / item * 16 * kQuarterVec4s, kFourWords, 0,
                          true);
    };
    quarters = boxes_of("quarters of nodes", nodes.buffer.size(), sizeof(Node));
    groups = boxes_of("groups of triangles", leaves.buffer.size(), sizeof(Leaf));
    leaf_vertices = filled("leaf vertices", bvh.leaf_vertices);
    leaf_parents = filled("leaf parents", bvh.leaf_parents);
    node_parents = filled("node parents", bvh.node_parents);
    repeated = bvh.repeated;
    repeated_texels = filled("repeated triangles", bvh.repeated);
}

void SceneBuffers::set_positions(Transfer& transfer, std::span<const vec3> positions) {
    if (positions.empty()) return;
    const IndexRange all[] = {{0, vertex_count_}};
    transfer.run(set_positions(positions, all));
}

Record SceneBuffers::set_positions(std::span<const vec3> positions,
                                   std::span<const IndexRange> ranges) {
    assert(positions.size() == vertex_count_);
    std::vector<VertexRun> runs;
    for (const IndexRange range : ranges)
        runs.push_back({range.begin, positions.subspan(range.begin, range.end - range.begin)});
    return set_vertices(positions_.buffer, staged_positions_, runs);
}

/// As set_positions(), through `staged` if the host does not see the memory of `to`.
Record SceneBuffers::set_vertices(const Buffer& to, Buffer& staged,
                                  std::span<const VertexRun> runs) {
    if (runs.empty()) return {};
    const std::size_t vertex_bytes = bytes_of_vertex(kind_);
    const bool is_staged = to.mapped().empty();
    if (is_staged && staged.get() == VK_NULL_HANDLE)
        staged =
            Buffer(*device_, "staged positions", vertex_bytes * vertex_count_, 0, Memory::kHost);
    const Buffer& written = is_staged ? staged : to;
    std::vector<VkBufferCopy> copies;
    for (const auto& [first, positions] : runs) {
        const VkDeviceSize begin = vertex_bytes * first;
        const VkDeviceSize size = vertex_bytes * positions.size();
        write_threes(kind_, positions, written.mapped().subspan(begin, size));
        copies.push_back({.srcOffset = begin, .dstOffset = begin, .size = size});
    }
    if (!is_staged) return {};
    return [copies = std::move(copies), from = written.get(),
            to = to.get()](VkCommandBuffer commands) {
        vkCmdCopyBuffer(commands, from, to, static_cast<std::uint32_t>(copies.size()),
                        copies.data());
        // Writer: the copy; reader: kernels.
        barrier(commands);
    };
}

/// Returns true if it has made the buffer, for it was too small.
bool SceneBuffers::make_room(ReadBuffer& buffer, const char* name, std::size_t size) {
    if (buffer.buffer.get() != VK_NULL_HANDLE && buffer.buffer.size() >= size) return false;
    buffer = ReadBuffer(*device_, kind_, name, size, kFourWords);
    return true;
}

bool SceneBuffers::set_normals(Transfer& transfer, const VertexNormals& normals) {
    if (normals_version_ == normals.version()) return false;
    bool has_made = false;
    const auto set = [&](ReadBuffer& buffer, const char* name, auto threes) {
        std::vector<std::byte> bytes(bytes_of_vertex(kind_) * threes.size());
        write_threes(kind_, threes, std::span(bytes));
        has_made |= make_room(buffer, name, bytes.size());
        transfer.upload(bytes, buffer.buffer);
    };
    normals_version_ = 0;
    set(normals_, "normals", normals.normals());
    set(normal_ids_, "normals of corners", normals.ids());
    normals_version_ = normals.version();
    return has_made;
}

bool SceneBuffers::set_rest_positions(Transfer& transfer, std::span<const Body> bodies) {
    if (bodies.empty()) return false;
    const bool has_made =
        make_room(rest_positions_, "rest positions", bytes_of_vertex(kind_) * vertex_count_);
    std::vector<VertexRun> runs;
    for (const Body& body : bodies)
        if (rest_versions_[body.first_vertex] != body.rest_version)
            runs.push_back({body.first_vertex, body.rest});
    Buffer staged;
    transfer.run(set_vertices(rest_positions_.buffer, staged, runs));
    for (const Body& body : bodies) rest_versions_[body.first_vertex] = body.rest_version;
    // Last: a failure above must not lose that a buffer was made.
    return make_room(bodies_, "bodies", sizeof(BodyRecord) * bodies.size()) || has_made;
}

Record SceneBuffers::move_bodies(const Kernels& kernels, std::span<const Body> bodies) const {
    std::vector<BodyRecord> records;
    std::uint32_t group_count = 0;
    for (const Body& body : bodies) {
        const auto centre = [&](int axis) { return static_cast<float>(body.space.centre(axis)); };
        records.push_back(
            {body.transform,
             {centre(0), centre(1), centre(2), std::ldexp(1.0f, body.space.exponent())},
             {body.first_vertex, body.end_vertex(), group_count, 0}});
        group_count += groups_of_body(body);
    }
    return [records = std::move(records), group_count, to = bodies_.buffer.get(),
            kernel = &kernels.move_bodies](VkCommandBuffer commands) {
        // That many bytes fit into a command.
        constexpr std::size_t kMost = 65536 / sizeof(BodyRecord);
        for (std::size_t first = 0; first < records.size(); first += kMost) {
            const std::size_t count = std::min(kMost, records.size() - first);
            vkCmdUpdateBuffer(commands, to, sizeof(BodyRecord) * first, sizeof(BodyRecord) * count,
                              &records[first]);
        }
        barrier(commands);
        kernel->dispatch(commands, CountArguments{static_cast<std::uint32_t>(records.size())},
                         group_count);
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
    tree_.quarters.bind(bindings, kBindQuarters);
    tree_.groups.bind(bindings, kBindGroups);
    tree_.nodes.bind(bindings, kBindNodeWords, true);
    tree_.leaves.bind(bindings, kBindLeafWords, true);
    tree_.quarters.bind(bindings, kBindQuarterWords, true);
    tree_.groups.bind(bindings, kBindGroupWords, true);
    // Kernels that shade flat triangles are bound to something, too.
    const bool has_normals = normal_ids_.buffer.get() != VK_NULL_HANDLE;
    (has_normals ? normals_ : positions_).bind(bindings, kBindNormals);
    (has_normals ? normal_ids_ : positions_).bind(bindings, kBindNormalIds);
    positions_.bind(bindings, kBindMovedPositions);
    rest_positions_.bind(bindings, kBindRestPositions);
    bodies_.bind(bindings, kBindBodies);
}

PositionUpdate all_positions(const Pose& pose) {
    const auto count = static_cast<std::uint32_t>(pose.positions().size());
    if (count == 0) return {};
    return {.copied = {{0, count}}};
}

PositionUpdate moved_positions(const Context& context, const Pose& pose) {
    std::span<const Body> bodies = pose.bodies();
    std::uint64_t group_count = 0;
    for (const Body& body : bodies) group_count += groups_of_body(body);
    const VkPhysicalDeviceLimits& limits = context.physical().limits;
    // A body has a group or more, and kBodyVec4s texels.
    if (group_count >
        std::min(limits.maxComputeWorkGroupCount[0], limits.maxTexelBufferElements / kBodyVec4s))
        bodies = {};
    return {moved_vertices(pose, bodies), bodies};
}

Record refit_scene(const Context& context, const Kernels& kernels, SceneBuffers& scene,
                   const PositionUpdate& update, const Pose& pose, const RefitPlan& plan) {
    Record upload = scene.set_positions(pose.positions(), update.copied);
    Record move;
    if (!update.bodies.empty()) move = scene.move_bodies(kernels, update.bodies);
    std::vector<RefitDispatch> dispatches = dispatches_of(context, kernels, scene, plan);
    if (!upload && !move && dispatches.empty()) return {};
    return [upload = std::move(upload), move = std::move(move),
            dispatches = std::move(dispatches)](VkCommandBuffer commands) {
        if (upload) upload(commands);
        if (move) move(commands);
        for (std::size_t i = 0; i < dispatches.size(); ++i) {
            // Writer: the level below, or leaves of another range, which validation cannot
            // distinguish; reader: this dispatch.
            if (i > 0) barrier(commands);
            const auto& [kernel, arguments] = dispatches[i];
            kernel->dispatch(commands, arguments,
                             (arguments.count + kItemsOfGroup - 1) / kItemsOfGroup);
        }
    };
}

}  // namespace mray::gpu
