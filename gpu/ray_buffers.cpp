#include "gpu/ray_buffers.h"

#include <algorithm>
#include <utility>

namespace mray::gpu {
namespace {

constexpr VkBufferUsageFlags kWritten = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;

}  // namespace

RayBuffers::RayBuffers(Device& device, const PassSize& pass_size, BufferKind buffer_kind)
    : size(pass_size),
      kind(buffer_kind),
      rays(device, kind, "rays", sizeof(Ray) * size.rays(), VK_FORMAT_R32G32B32A32_UINT),
      hits(device, kind, "hits", sizeof(Hit) * size.rays(), VK_FORMAT_R32G32B32A32_UINT, kWritten),
      visible_pixels(device, kind, "visible pixels", 4 * size.rays(), VK_FORMAT_R32_UINT, kWritten),
      occlusion(device, kind, "occlusion", 4 * size.rays(), VK_FORMAT_R32_UINT, kWritten),
      pixels(device, "pixels", 4 * size.rays(), kWritten, Memory::kDevice),
      work(device, "work", sizeof(WorkHeader) + sizeof(Suspended) * size.rays(), kWritten,
           Memory::kDevice),
      states(device, "states", 4 * kStateUints * size.resume_slots, kWritten, Memory::kDevice),
      header(device, "work header", sizeof(WorkHeader), 0, Memory::kHost) {
    const auto add_copy = [&](Buffer& copy, const char* name, const Buffer& buffer) {
        if (buffer.mapped().empty()) copy = Buffer(device, name, buffer.size(), 0, Memory::kHost);
    };
    add_copy(hits_copy, "copy of hits", hits.buffer);
    add_copy(occlusion_copy, "copy of occlusion", occlusion.buffer);
    add_copy(pixels_copy, "copy of pixels", pixels);
}

void RayBuffers::add_to(Bindings& bindings) const {
    rays.bind(bindings, kBindRays);
    visible_pixels.bind(bindings, kBindVisiblePixels);
    bindings.buffers[kBindVisiblePixelsOut] = visible_pixels.buffer.get();
    hits.bind(bindings, kBindFoundHits);
    bindings.buffers[kBindHits] = hits.buffer.get();
    occlusion.bind(bindings, kBindFoundOcclusion);
    bindings.buffers[kBindOcclusion] = occlusion.buffer.get();
    bindings.buffers[kBindPixels] = pixels.get();
    bindings.buffers[kBindWork] = work.get();
    bindings.buffers[kBindStates] = states.get();
}

std::unique_ptr<RayBuffers> RayBufferPool::take(Device& device, const PassSize& size,
                                                BufferKind kind) {
    std::unique_lock lock(mutex_);
    const auto place = std::ranges::find_if(
        idle_, [&](const auto& buffers) { return buffers->size == size && buffers->kind == kind; });
    if (place != idle_.end()) {
        std::unique_ptr<RayBuffers> buffers = std::move(*place);
        idle_.erase(place);
        return buffers;
    }
    lock.unlock();
    return std::make_unique<RayBuffers>(device, size, kind);
}

void RayBufferPool::give_back(std::unique_ptr<RayBuffers> buffers) noexcept {
    try {
        const std::scoped_lock lock(mutex_);
        idle_.push_back(std::move(buffers));
    } catch (const std::bad_alloc&) {
        // The buffers are freed instead.
    }
}

}  // namespace mray::gpu
