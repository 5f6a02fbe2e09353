#include "gpu/ray_passes.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "common/error.h"

namespace morphray::gpu {
namespace {

constexpr VkBufferUsageFlags kStorage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;

}  // namespace

RayPasses::RayPasses(Context& context, const PassSize& size, std::uint32_t step_budget)
    : context_(context),
      size_(size),
      step_budget_(step_budget),
      rays_(context, "rays", sizeof(Ray) * size.rays(), VK_FORMAT_R32G32B32A32_UINT),
      hits_(context, "hits", sizeof(Hit) * size.rays(), kStorage, Memory::kDevice),
      seen_(context, "pixels seen", 4 * size.rays(), VK_FORMAT_R32_UINT,
            VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | kStorage),
      occlusion_(context, "occlusion", 4 * size.rays(), kStorage, Memory::kDevice),
      pixels_(context, "pixels", 4 * size.rays(), kStorage, Memory::kDevice),
      work_(context, "work", sizeof(WorkHeader) + sizeof(Suspended) * size.rays(), kStorage,
            Memory::kDevice),
      states_(context, "states", 4 * kStateUints * size.resume_slots, kStorage, Memory::kDevice),
      header_copy_(context, "work header", sizeof(WorkHeader), 0, Memory::kHost) {}

void RayPasses::add_to(Bindings& bindings) const {
    bindings.views[kBindRays] = rays_.view.get();
    bindings.views[kBindSeen] = seen_.view.get();
    bindings.buffers[kBindSeenOut] = seen_.buffer.get();
    bindings.buffers[kBindHits] = hits_.get();
    bindings.buffers[kBindOcclusion] = occlusion_.get();
    bindings.buffers[kBindPixels] = pixels_.get();
    bindings.buffers[kBindWork] = work_.get();
    bindings.buffers[kBindStates] = states_.get();
}

double RayPasses::run(const char* what, const Kernels& kernels, const SceneBuffers& scene,
                      bool any_hit, const std::function<void(VkCommandBuffer)>& dispatch,
                      const std::function<void(VkCommandBuffer)>& rest) {
    const Outcome outcome = submit(what, 0, dispatch);
    if ((outcome.header.status & kStatusUnfinished) != 0) {
        return outcome.device_ms + run(what, kernels, scene, any_hit, rest);
    }
    if (outcome.header.suspended_count == 0) return outcome.device_ms;
    return outcome.device_ms + resume(kernels, scene, any_hit, outcome.header.suspended_count);
}

double RayPasses::select(const std::function<void(VkCommandBuffer)>& dispatch,
                         std::uint32_t& seen_count) {
    const Outcome outcome = submit("select pixels", 0, dispatch);
    seen_count = outcome.header.seen_count;
    return outcome.device_ms;
}

RayPasses::Outcome RayPasses::submit(const char* what, VkDeviceSize reset_offset,
                                     const std::function<void(VkCommandBuffer)>& dispatch) {
    const double device_ms = context_.submit(what, [&](VkCommandBuffer commands) {
        vkCmdFillBuffer(commands, work_.get(), reset_offset, sizeof(WorkHeader) - reset_offset, 0);
        // Writer: the fill; reader and writer: the kernel's counters.
        barrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT);
        dispatch(commands);
        // Writer: the kernel's counters; reader: the copy.
        barrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT,
                VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_READ_BIT);
        const VkBufferCopy region = {.srcOffset = 0, .dstOffset = 0, .size = sizeof(WorkHeader)};
        vkCmdCopyBuffer(commands, work_.get(), header_copy_.get(), 1, &region);
    });
    Outcome outcome = {{}, device_ms};
    std::memcpy(&outcome.header, header_copy_.mapped().data(), sizeof(WorkHeader));
    if ((outcome.header.status & kStatusStackOverflow) != 0) {
        throw Error(ExitCode::kInternal, "Vulkan: a traversal stack overflowed while trying to " +
                                             std::string(what) + "; the tree is not sound");
    }
    return outcome;
}

double RayPasses::resume(const Kernels& kernels, const SceneBuffers& scene, bool any_hit,
                         std::uint32_t count) {
    // A ray visits each node and leaf at most once, for at most 20 steps each, pops included, and a
    // round visits at least one. More rounds mean that the tree is not a tree.
    const std::uint64_t max_rounds =
        2 + 20ull * (scene.node_count() + scene.leaf_count()) / step_budget_;
    double device_ms = 0;
    for (std::uint32_t first = 0; first < count; first += size_.resume_slots) {
        ResumeArguments arguments = {
            .first = first,
            .count = std::min(size_.resume_slots, count - first),
            .fresh = 1,
            .any_hit = any_hit ? 1u : 0u,
        };
        const std::uint32_t groups = (arguments.count + kGroupSize - 1) / kGroupSize;
        std::uint64_t rounds = 0;
        for (bool unfinished = true; unfinished; arguments.fresh = 0) {
            if (++rounds > max_rounds) {
                throw Error(ExitCode::kInternal,
                            "Vulkan: a traversal does not end; the tree is not sound");
            }
            const Outcome outcome = submit("resume rays", offsetof(WorkHeader, unfinished_count),
                                           [&](VkCommandBuffer commands) {
                                               kernels.resume.dispatch(commands, arguments, groups);
                                           });
            device_ms += outcome.device_ms;
            unfinished = outcome.header.unfinished_count != 0;
        }
    }
    return device_ms;
}

}  // namespace morphray::gpu
