#include "lab/bench/gpu/peer_tracer.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/bvh/builder/binary_tree.h"

// Generated from peer.comp; it uses std::uint32_t without including it.
#include "lab/bench/gpu/peer_spirv.h"

namespace mray::bench {
namespace {

constexpr VkBufferUsageFlags kStorage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
constexpr std::uint64_t kTimeLimitMs = 60'000;

std::uint64_t pixels_of(const ImageParams& params) {
    return std::uint64_t{params.width} * params.height;
}

/// Turns the builder's binary tree, whose leaves are single triangles, into the peer's.
class PeerBuilder {
public:
    PeerBuilder(std::span<const uvec3> triangles, std::span<const vec3> positions)
        : triangles_(triangles), positions_(positions) {
        AlignedVector<PrimRef> refs;
        for (std::uint32_t i = 0; i < triangles.size(); ++i) {
            Box box;
            for (int k = 0; k < 3; ++k) box.extend(positions[triangles[i][k]]);
            refs.emplace_back(box, i);
        }
        // Without triangles in the topology each ref is a part, which is a leaf of its own.
        from_ = build_binary_tree(Topology{}, std::move(refs), SplitMethod::kBinned);
    }

    PeerTree build() {
        add_node(from_.nodes.front());
        return std::move(to_);
    }

private:
    static constexpr std::uint32_t kMostTriangles = 4;
    /// The cost of a node, in tests of a triangle.
    static constexpr float kNodeCost = 1.5f;

    static float area(const Box& box) {
        const vec3 d = box.upper - box.lower;
        return d.x * d.y + d.y * d.z + d.z * d.x;
    }

    int add_node(const BinaryNode& node) {
        const std::size_t at = to_.nodes.size();
        to_.nodes.resize(at + kPeerNodeVec4s);
        const BinaryNode& left = from_.nodes[node.children];
        const BinaryNode& right = from_.nodes[node.children + 1];
        const float first = std::bit_cast<float>(add(left));
        const float second = std::bit_cast<float>(add(right));
        const Box& a = left.box;
        const Box& b = right.box;
        to_.nodes[at] = {a.lower.x, a.upper.x, a.lower.y, a.upper.y};
        to_.nodes[at + 1] = {b.lower.x, b.upper.x, b.lower.y, b.upper.y};
        to_.nodes[at + 2] = {a.lower.z, a.upper.z, b.lower.z, b.upper.z};
        to_.nodes[at + 3] = {first, second, 0, 0};
        return static_cast<int>(at / kPeerNodeVec4s);
    }

    /// Adds a child, which is a leaf where few triangles cost no more than a node.
    int add(const BinaryNode& node) {
        if (node.is_leaf()) return add_leaf(node);
        const BinaryNode& left = from_.nodes[node.children];
        const BinaryNode& right = from_.nodes[node.children + 1];
        const auto cost = [](const BinaryNode& n) {
            return area(n.box) * static_cast<float>(n.size());
        };
        if (node.size() <= kMostTriangles &&
            cost(node) <= cost(left) + cost(right) + kNodeCost * area(node.box))
            return add_leaf(node);
        return add_node(node);
    }

    int add_leaf(const BinaryNode& node) {
        const auto first = static_cast<int>(to_.triangles.size() / kPeerTriangleVec4s);
        for (const std::uint32_t prim_id : from_.triangles(node)) {
            const uvec3 t = triangles_[prim_id];
            to_.triangles.emplace_back(positions_[t.x], std::bit_cast<float>(prim_id));
            to_.triangles.emplace_back(positions_[t.y], 0.0f);
            to_.triangles.emplace_back(positions_[t.z], 0.0f);
        }
        return ~(8 * first + static_cast<int>(node.size()));
    }

    std::span<const uvec3> triangles_;
    std::span<const vec3> positions_;
    BinaryTree from_;
    PeerTree to_;
};

}  // namespace

PeerTree build_peer_tree(std::span<const uvec3> triangles, std::span<const vec3> positions) {
    return PeerBuilder(triangles, positions).build();
}

PeerTracer::PeerTracer(std::shared_ptr<gpu::SharedDevice> device, const PeerTree& tree,
                       const ImageParams& params, std::span<const Ray> rays)
    : shared_(std::move(device)),
      tree_(tree),
      params_(params),
      ray_count_(static_cast<std::uint32_t>(rays.size())),
      context_(shared_->device, kTimeLimitMs),
      transfer_(context_) {
    const auto make = [&](const char* name, std::uint64_t size) {
        return gpu::Buffer(shared_->device, name, size, kStorage, gpu::Memory::kDevice);
    };
    nodes_ = make("peer's nodes", sizeof(vec4) * tree.nodes.size());
    triangles_ = make("peer's triangles", sizeof(vec4) * tree.triangles.size());
    rays_ = make("peer's rays", rays.size_bytes());
    hits_ =
        make("peer's hits", sizeof(Hit) * std::max<std::uint64_t>(pixels_of(params), rays.size()));
    occluded_ = make("peer's occlusion", 4 * pixels_of(params));
    transfer_.upload(std::as_bytes(std::span(tree.nodes)), nodes_);
    transfer_.upload(std::as_bytes(std::span(tree.triangles)), triangles_);
    transfer_.upload(std::as_bytes(rays), rays_);
    gpu::Bindings bindings;
    bindings.buffers[kBindNodes] = nodes_.get();
    bindings.buffers[kBindLeaves] = triangles_.get();
    bindings.buffers[kBindRays] = rays_.get();
    bindings.buffers[kBindHits] = hits_.get();
    bindings.buffers[kBindOcclusion] = occluded_.get();
    for (const std::uint32_t mode : {kPeerCamera, kPeerShadow, kPeerRays}) {
        gpu::BoundPipeline& bound = pipelines_.emplace_back(
            shared_->device, shared_->pipelines.get(shared_->device, "peer", k_peer_spirv, {mode}));
        bound.bind(bindings);
    }
}

double PeerTracer::trace(std::uint32_t mode) {
    PeerArguments arguments = {};
    arguments.params = params_;
    arguments.tile_columns = (params_.width + kTileSize - 1) / kTileSize;
    arguments.ray_count = ray_count_;
    std::uint32_t groups = arguments.tile_columns * ((params_.height + kTileSize - 1) / kTileSize);
    if (mode == kPeerRays) groups = (ray_count_ + kGroupSize - 1) / kGroupSize;
    return context_.submit("trace the peer's rays", [&](VkCommandBuffer commands) {
        pipelines_[mode].dispatch(commands, arguments, groups);
    });
}

double PeerTracer::copy(std::uint64_t bytes) {
    for (gpu::Buffer* const buffer : {&from_, &to_}) {
        if (buffer->size() < bytes)
            *buffer = gpu::Buffer(shared_->device, "copied", bytes, 0, gpu::Memory::kDevice);
    }
    return context_.submit("copy", [&](VkCommandBuffer commands) {
        const VkBufferCopy region = {.srcOffset = 0, .dstOffset = 0, .size = bytes};
        vkCmdCopyBuffer(commands, from_.get(), to_.get(), 1, &region);
    });
}

std::vector<Hit> PeerTracer::hits(std::size_t count) {
    std::vector<Hit> hits(count);
    transfer_.download(hits_, std::as_writable_bytes(std::span(hits)));
    for (Hit& hit : hits)
        if (hit.prim_id != kNoPrim)
            hit.prim_id =
                std::bit_cast<std::uint32_t>(tree_.triangles[kPeerTriangleVec4s * hit.prim_id].w);
    return hits;
}

}  // namespace mray::bench
