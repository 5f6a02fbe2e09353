#include "lab/methods/gpu_peer.h"

#include <bit>

// Generated from gpu_peer.comp; it uses std::uint32_t without including it.
#include "lab/methods/gpu_peer_spirv.h"

namespace mray::lab {
namespace {

constexpr std::uint64_t kTimeLimitMs = 60'000;

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

GpuPeer::GpuPeer(std::shared_ptr<gpu::SharedDevice> device, const PeerTree& tree,
                 const ImageParams& params, std::size_t most_rays)
    : shared_(std::move(device)),
      tree_(tree),
      params_(params),
      context_(shared_->device, kTimeLimitMs),
      transfer_(context_) {
    const std::vector<vec4> nodes = kernel_nodes(tree);
    const std::vector<vec4> triangles = kernel_triangles(tree);
    const auto make_buffer = [&](const char* name, std::uint64_t size,
                                 std::span<const vec4> content = {}) {
        gpu::Buffer buffer(shared_->device, name, size, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                           gpu::Memory::kDevice);
        if (!content.empty()) transfer_.upload(std::as_bytes(content), buffer);
        return buffer;
    };
    nodes_ = make_buffer("peer's nodes", sizeof(vec4) * nodes.size(), nodes);
    triangles_ = make_buffer("peer's triangles", sizeof(vec4) * triangles.size(), triangles);
    // No buffer is empty.
    const std::uint64_t pixels =
        std::max<std::uint64_t>(std::uint64_t{params.width} * params.height, 1);
    most_rays = std::max<std::size_t>(most_rays, 1);
    rays_ = make_buffer("peer's rays", sizeof(Ray) * most_rays);
    hits_ = make_buffer("peer's hits", sizeof(Hit) * std::max<std::uint64_t>(pixels, most_rays));
    occluded_ = make_buffer("peer's occlusion", 4 * pixels);
    gpu::Bindings bindings;
    bindings.buffers[kBindNodes] = nodes_.get();
    bindings.buffers[kBindLeaves] = triangles_.get();
    bindings.buffers[kBindRays] = rays_.get();
    bindings.buffers[kBindHits] = hits_.get();
    bindings.buffers[kBindOcclusion] = occluded_.get();
    for (const std::uint32_t mode : {kPeerCamera, kPeerShadow, kPeerRays}) {
        gpu::BoundPipeline& bound = pipelines_.emplace_back(
            shared_->device, shared_->pipelines.get(shared_->device, k_gpu_peer_spirv, {mode}));
        bound.bind(bindings);
    }
}

void GpuPeer::set_rays(std::span<const Ray> rays) {
    ray_count_ = static_cast<std::uint32_t>(rays.size());
    transfer_.upload(std::as_bytes(rays), rays_);
}

double GpuPeer::trace(std::uint32_t mode) {
    PeerArguments arguments = {};
    arguments.params = params_;
    // The size of the kernels' tiles, not of those of the benchmark.
    constexpr std::uint32_t kSide = mray::kTileSize;
    arguments.tile_columns = (params_.width + kSide - 1) / kSide;
    arguments.ray_count = ray_count_;
    std::uint32_t groups = arguments.tile_columns * ((params_.height + kSide - 1) / kSide);
    if (mode == kPeerRays) groups = (ray_count_ + kGroupSize - 1) / kGroupSize;
    return context_.submit("trace the peer's rays", [&](VkCommandBuffer commands) {
        pipelines_[mode].dispatch(commands, arguments, groups);
    });
}

void GpuPeer::read_hits(std::span<Hit> hits) {
    transfer_.download(hits_, std::as_writable_bytes(hits));
    for (Hit& hit : hits)
        if (hit.prim_id != kNoPrim) hit.prim_id = tree_.triangles[hit.prim_id].prim_id;
}

}  // namespace mray::lab
