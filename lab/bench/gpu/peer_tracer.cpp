#include "lab/bench/gpu/peer_tracer.h"

#include <algorithm>
#include <bit>
#include <utility>

// Generated from peer.comp; it uses std::uint32_t without including it.
#include "lab/bench/gpu/peer_spirv.h"

namespace mray::bench {
namespace {

constexpr VkBufferUsageFlags kStorage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
constexpr std::uint64_t kTimeLimitMs = 60'000;

std::uint64_t pixels_of(const ImageParams& params) {
    return std::uint64_t{params.width} * params.height;
}

/// The nodes as the kernel reads them: one for each pair of children, which follow the root.
std::vector<vec4> kernel_nodes(const PeerTree& tree) {
    const auto reference = [](const PeerNode& node) {
        const std::uint32_t child =
            node.count > 0 ? ~(8 * node.first + node.count) : (node.first - 1) / 2;
        return std::bit_cast<float>(child);
    };
    std::vector<vec4> made;
    for (std::size_t i = 1; i + 1 < tree.nodes.size(); i += 2) {
        const PeerNode& a = tree.nodes[i];
        const PeerNode& b = tree.nodes[i + 1];
        made.emplace_back(a.lower.x, a.upper.x, a.lower.y, a.upper.y);
        made.emplace_back(b.lower.x, b.upper.x, b.lower.y, b.upper.y);
        made.emplace_back(a.lower.z, a.upper.z, b.lower.z, b.upper.z);
        made.emplace_back(reference(a), reference(b), 0.0f, 0.0f);
    }
    return made;
}

std::vector<vec4> kernel_triangles(const PeerTree& tree) {
    std::vector<vec4> made;
    for (const PeerTriangle& triangle : tree.triangles) {
        made.emplace_back(triangle.a, std::bit_cast<float>(triangle.prim_id));
        made.emplace_back(triangle.b, 0.0f);
        made.emplace_back(triangle.c, 0.0f);
    }
    return made;
}

}  // namespace

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
    const std::vector<vec4> nodes = kernel_nodes(tree);
    const std::vector<vec4> triangles = kernel_triangles(tree);
    nodes_ = make("peer's nodes", sizeof(vec4) * nodes.size());
    triangles_ = make("peer's triangles", sizeof(vec4) * triangles.size());
    rays_ = make("peer's rays", rays.size_bytes());
    hits_ =
        make("peer's hits", sizeof(Hit) * std::max<std::uint64_t>(pixels_of(params), rays.size()));
    occluded_ = make("peer's occlusion", 4 * pixels_of(params));
    transfer_.upload(std::as_bytes(std::span(nodes)), nodes_);
    transfer_.upload(std::as_bytes(std::span(triangles)), triangles_);
    transfer_.upload(std::as_bytes(rays), rays_);
    gpu::Bindings bindings;
    bindings.buffers[kBindNodes] = nodes_.get();
    bindings.buffers[kBindLeaves] = triangles_.get();
    bindings.buffers[kBindRays] = rays_.get();
    bindings.buffers[kBindHits] = hits_.get();
    bindings.buffers[kBindOcclusion] = occluded_.get();
    for (const std::uint32_t mode : {kPeerCamera, kPeerShadow, kPeerRays}) {
        gpu::BoundPipeline& bound = pipelines_.emplace_back(
            shared_->device, shared_->pipelines.get(shared_->device, k_peer_spirv, {mode}));
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
        if (hit.prim_id != kNoPrim) hit.prim_id = tree_.triangles[hit.prim_id].prim_id;
    return hits;
}

}  // namespace mray::bench
