#include "lab/bench/gpu/peer_tracer.h"

#include <algorithm>
#include <cstring>
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
    nodes_ = make("peer's nodes", sizeof(vec4) * tree.nodes.size());
    triangles_ = make("peer's triangles", sizeof(vec4) * tree.triangles.size());
    rays_ = make("peer's rays", rays.size_bytes());
    hits_ =
        make("peer's hits", sizeof(Hit) * std::max<std::uint64_t>(pixels_of(params), rays.size()));
    occluded_ = make("peer's occlusion", 4 * pixels_of(params) * std::max(params.ao_count, 1u));
    transfer_.upload(std::as_bytes(std::span(tree.nodes)), nodes_);
    transfer_.upload(std::as_bytes(std::span(tree.triangles)), triangles_);
    transfer_.upload(std::as_bytes(rays), rays_);
    pixels_.resize(4 * pixels_of(params));
    gpu::Bindings bindings;
    bindings.buffers[kBindNodes] = nodes_.get();
    bindings.buffers[kBindLeaves] = triangles_.get();
    bindings.buffers[kBindRays] = rays_.get();
    bindings.buffers[kBindHits] = hits_.get();
    bindings.buffers[kBindOcclusion] = occluded_.get();
    for (const std::uint32_t mode : {kPeerCamera, kPeerShadow, kPeerAo, kPeerRays}) {
        gpu::BoundPipeline& bound = pipelines_.emplace_back(
            shared_->device, shared_->pipelines.get(shared_->device, "peer", k_peer_spirv, {mode}));
        bound.bind(bindings);
    }
}

double PeerTracer::trace(std::uint32_t mode) {
    PeerArguments arguments = {};
    arguments.params = params_;
    arguments.tile_columns = (params_.width + kTileSize - 1) / kTileSize;
    arguments.tile_count = arguments.tile_columns * ((params_.height + kTileSize - 1) / kTileSize);
    arguments.ray_count = ray_count_;
    std::uint32_t groups = arguments.tile_count;
    if (mode == kPeerAo) groups *= params_.ao_count;
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

void PeerTracer::upload(std::span<const std::byte> bytes) {
    if (staging_.size() < bytes.size())
        staging_ = gpu::Buffer(shared_->device, "staged", bytes.size(), 0, gpu::Memory::kHost);
    if (to_.size() < bytes.size())
        to_ = gpu::Buffer(shared_->device, "copied", bytes.size(), 0, gpu::Memory::kDevice);
    std::memcpy(staging_.mapped().data(), bytes.data(), bytes.size());
    context_.submit("upload", [&](VkCommandBuffer commands) {
        const VkBufferCopy region = {.srcOffset = 0, .dstOffset = 0, .size = bytes.size()};
        vkCmdCopyBuffer(commands, staging_.get(), to_.get(), 1, &region);
    });
}

void PeerTracer::download_pixels() { transfer_.download(occluded_, pixels_); }

std::vector<Hit> PeerTracer::hits(std::size_t count) {
    std::vector<Hit> hits(count);
    transfer_.download(hits_, std::as_writable_bytes(std::span(hits)));
    for (Hit& hit : hits)
        if (hit.prim_id != kNoPrim) hit.prim_id = tree_.prim_id(hit.prim_id);
    return hits;
}

}  // namespace mray::bench
