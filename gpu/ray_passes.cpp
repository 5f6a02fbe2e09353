#include "gpu/ray_passes.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "common/base/errors.h"

namespace mray::gpu {
namespace {

// The most steps that traverse() counts for a node or leaf that is visited once
// (shaders/single_ray/traverse.glsl). A leaf of 16 triangles: 2, 16, and one each for those that
// are certain, but at least 1; the queue of uncertain ones, whose number together with the certain
// ones is at most 16, but at least 1; 1 each for the pop that finds it and the one that ends it; 3
// and 1 for the loops around it. The sum is at most 2 + 16 + 16 + 1 + 2 + 4 = 41.
constexpr std::uint64_t kStepsOfVisit = 41;

}  // namespace

RayPasses::RayPasses(SharedDevice& device, Context& context, const PassSize& size, BufferKind kind,
                     std::uint32_t step_budget)
    : device_(device), context_(context), size_(size), kind_(kind), step_budget_(step_budget) {}

RayPasses::Use RayPasses::use() {
    buffers_ = device_.ray_buffers.take(device_.device, size_, kind_);
    return Use(*this);
}

double RayPasses::run(const RayPass& pass, Kernels& kernels, const SceneBuffers& scene) {
    double device_ms = 0;
    submit_part(pass.what, Reset::kRays, pass.dispatch, device_ms);
    const std::uint32_t count = header(pass.what).suspended_count;
    return device_ms + resume(kernels, scene, pass.any_hit, count);
}

void RayPasses::reset(VkCommandBuffer commands, Reset what) const {
    const VkDeviceSize begin =
        what == Reset::kUnfinished ? offsetof(WorkHeader, unfinished_count) : 0;
    const VkDeviceSize end =
        what == Reset::kAll ? sizeof(WorkHeader) : offsetof(WorkHeader, visible_count);
    vkCmdFillBuffer(commands, buffers_->work.get(), begin, end - begin, 0);
    // Writer: the fill; reader and writer: the kernel's counters.
    barrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
            VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
            VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT);
}

void RayPasses::end(VkCommandBuffer commands) const {
    // Writer: the kernels' counters; reader: the copy.
    barrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT,
            VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_READ_BIT);
    const VkBufferCopy region = {.srcOffset = 0, .dstOffset = 0, .size = sizeof(WorkHeader)};
    vkCmdCopyBuffer(commands, buffers_->work.get(), buffers_->header.get(), 1, &region);
}

void RayPasses::copy_results(VkCommandBuffer commands, std::uint32_t count, bool with_hits,
                             bool with_occlusion, bool with_pixels) const {
    if (!buffers_->pixels.mapped().empty()) return;
    // Writer: the kernels; reader: the copies.
    barrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT,
            VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_READ_BIT);
    const auto copy = [&](const Buffer& from, const Buffer& to, VkDeviceSize size) {
        const VkBufferCopy region = {.srcOffset = 0, .dstOffset = 0, .size = size};
        vkCmdCopyBuffer(commands, from.get(), to.get(), 1, &region);
    };
    if (with_hits) copy(buffers_->hits.buffer, buffers_->hits_copy, sizeof(Hit) * count);
    if (with_occlusion)
        copy(buffers_->occlusion.buffer, buffers_->occlusion_copy, VkDeviceSize{4} * count);
    if (with_pixels) copy(buffers_->pixels, buffers_->pixels_copy, VkDeviceSize{4} * count);
}

void RayPasses::submit_part(const char* what, Reset reset_what, const Record& dispatch,
                            double& device_ms) {
    device_ms += context_.submit(what, [&](VkCommandBuffer commands) {
        reset(commands, reset_what);
        dispatch(commands);
        end(commands);
    });
}

WorkHeader RayPasses::header(const char* what) const {
    WorkHeader header;
    std::memcpy(&header, buffers_->header.mapped().data(), sizeof(WorkHeader));
    if ((header.status & kStatusStackOverflow) != 0) {
        throw Error(ErrorKind::kInternal, "Vulkan: a traversal stack overflowed while trying to " +
                                              std::string(what) + "; the tree is not sound");
    }
    return header;
}

double RayPasses::resume(Kernels& kernels, const SceneBuffers& scene, bool any_hit,
                         std::uint32_t count) {
    // A ray visits each node and leaf at most once, and a round visits at least one. More rounds
    // mean that the tree has a cycle.
    const std::uint64_t max_rounds =
        2 + kStepsOfVisit * (scene.node_count() + scene.leaf_count()) / step_budget_;
    if (count == 0) return 0;
    kernels.prepare({&kernels.resume});
    double device_ms = 0;
    for (std::uint32_t first = 0; first < count; first += size_.resume_slots) {
        ResumeArguments arguments = {
            .first = first,
            .count = std::min(size_.resume_slots, count - first),
            .fresh = 1,
            .any_hit = any_hit ? 1u : 0u,
        };
        const std::uint32_t groups = groups_of(arguments.count);
        std::uint64_t rounds = 0;
        for (bool unfinished = true; unfinished; arguments.fresh = 0) {
            if (++rounds > max_rounds) {
                throw Error(ErrorKind::kInternal,
                            "Vulkan: a traversal does not end; the tree is not sound");
            }
            const char* const what = "resume rays";
            const Record round = [&](VkCommandBuffer commands) {
                kernels.resume.dispatch(commands, arguments, groups);
            };
            submit_part(what, Reset::kUnfinished, round, device_ms);
            unfinished = header(what).unfinished_count != 0;
        }
    }
    return device_ms;
}

std::uint32_t RayPasses::ask(const char* what, const SceneBuffers& scene, QueryArguments& arguments,
                             const Record& dispatch) {
    double device_ms = 0;
    submit_part(what, Reset::kAll, dispatch, device_ms);
    const std::uint32_t count = header(what).suspended_count;
    // A question visits each node and each triangle at most once, and a round takes a step.
    const std::uint64_t max_rounds =
        2 + 64 * (scene.node_count() + kLeafTriangles * std::uint64_t{scene.leaf_count()});
    for (std::uint32_t first = 0; first < count; first += size_.resume_slots) {
        arguments.first = first;
        arguments.count = std::min(size_.resume_slots, count - first);
        arguments.round = kAskAnew;
        std::uint64_t rounds = 0;
        for (bool unfinished = true; unfinished; arguments.round = kAskAgain) {
            if (++rounds > max_rounds) {
                throw Error(ErrorKind::kInternal,
                            "Vulkan: a traversal does not end; the tree is not sound");
            }
            submit_part(what, Reset::kUnfinished, dispatch, device_ms);
            unfinished = header(what).unfinished_count != 0;
        }
    }
    return header(what).visible_count;
}

}  // namespace mray::gpu
