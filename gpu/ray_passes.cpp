#include "gpu/ray_passes.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "common/image/lit_view.h"

namespace mray::gpu {
namespace {

void copy_start(VkCommandBuffer commands, const Buffer& from, const Buffer& to, VkDeviceSize size) {
    const VkBufferCopy region = {.srcOffset = 0, .dstOffset = 0, .size = size};
    vkCmdCopyBuffer(commands, from.get(), to.get(), 1, &region);
}

}  // namespace

RayPasses::RayPasses(SharedDevice& device, Context& context, Kernels& kernels,
                     const SceneBuffers& scene, const PassSize& size)
    : device_(device), context_(context), kernels_(kernels), scene_(scene), size_(size) {}

RayPasses::Use RayPasses::use() {
    buffers_ = device_.ray_buffers.take(device_.device, size_, scene_.kind());
    return Use(this);
}

void RayPasses::decide(VkCommandBuffer commands, bool any_hit, std::uint32_t count) const {
    // Writer: the rays' answers and records; reader: the kernel.
    barrier(commands);
    kernels_.decide.dispatch(commands, DecideArguments{any_hit ? 1u : 0u}, groups_of(count));
}

double RayPasses::run(const char* what, bool any_hit, std::uint32_t count, const Record& dispatch) {
    const double device_ms = submit_pass(what, Reset::kRays, [&](VkCommandBuffer commands) {
        dispatch(commands);
        decide(commands, any_hit, count);
    });
    return device_ms + resume(any_hit, header().suspended_count);
}

void RayPasses::reset(VkCommandBuffer commands, Reset what) const {
    const VkDeviceSize begin =
        what == Reset::kUnfinished ? offsetof(WorkHeader, unfinished_count) : 0;
    const VkDeviceSize end =
        what == Reset::kAll ? sizeof(WorkHeader) : offsetof(WorkHeader, visible_count);
    vkCmdFillBuffer(commands, buffers_->work.get(), begin, end - begin, 0);
    // Writer: the fill; reader and writer: the kernel's counters.
    barrier(commands);
}

void RayPasses::end(VkCommandBuffer commands) const {
    // Writer: the kernels' counters; reader: the copy.
    barrier(commands);
    copy_start(commands, buffers_->work, buffers_->header, sizeof(WorkHeader));
}

void RayPasses::copy_results(VkCommandBuffer commands, const ResultCounts& counts) const {
    if (!buffers_->pixels.mapped().empty()) return;
    // Writer: the kernels; reader: the copies.
    barrier(commands);
    const RayBuffers& b = *buffers_;
    const auto copy = [&](const Buffer& from, const Buffer& to, std::uint32_t count,
                          VkDeviceSize bytes) {
        if (count != 0) copy_start(commands, from, to, count * bytes);
    };
    copy(b.hits.buffer, b.hits_copy, counts.hits, sizeof(Hit));
    copy(b.occlusion.buffer, b.occlusion_copy, counts.occlusion, 4);
    copy(b.pixels, b.pixels_copy, counts.pixels, 4);
    copy(b.linear, b.linear_copy, counts.linear, sizeof(LinearColour));
}

double RayPasses::submit_pass(const char* what, Reset reset_what, const Record& dispatch) {
    return context_.submit(what, [&](VkCommandBuffer commands) {
        reset(commands, reset_what);
        dispatch(commands);
        end(commands);
    });
}

WorkHeader RayPasses::header() const {
    WorkHeader header;
    std::memcpy(&header, buffers_->header.mapped().data(), sizeof(WorkHeader));
    return header;
}

double RayPasses::resume(bool any_hit, std::uint32_t count) {
    if (count == 0) return 0;
    kernels_.prepare({&kernels_.resume});
    return finish("resume rays", count, [&](VkCommandBuffer commands, const ActiveRays& active) {
        const ResumeArguments arguments = {.first = active.first,
                                           .count = active.count,
                                           .fresh = active.is_fresh ? 1u : 0u,
                                           .any_hit = any_hit ? 1u : 0u};
        kernels_.resume.dispatch(commands, arguments, groups_of(active.count));
    });
}

std::uint32_t RayPasses::answer(const char* what, QueryKernel& kernel, QueryArguments arguments) {
    submit_pass(what, Reset::kAll, [&](VkCommandBuffer commands) {
        kernel.begin.dispatch(commands, arguments, groups_of(arguments.count));
    });
    if (const std::uint32_t suspended_count = header().suspended_count; suspended_count > 0) {
        kernels_.prepare({&kernel.resume});
        finish(what, suspended_count, [&](VkCommandBuffer commands, const ActiveRays& active) {
            arguments.first = active.first;
            arguments.count = active.count;
            arguments.round = active.is_fresh ? kRoundAnew : kRoundAgain;
            kernel.resume.dispatch(commands, arguments, groups_of(active.count));
        });
    }
    return header().visible_count;
}

/// Dispatches for the suspended rays or queries [0, count), as many at a time as have room for
/// their states, until none is unfinished. Throws Error(kInternal) if the device never finishes.
double RayPasses::finish(const char* what, std::uint32_t count,
                         const std::function<void(VkCommandBuffer, const ActiveRays&)>& dispatch) {
    // Each node and each triangle is visited at most once, and a round takes a step.
    const std::uint64_t most_rounds =
        2 + 64 * (scene_.node_count() + std::uint64_t{kLeafTriangles} * scene_.leaf_count());
    double device_ms = 0;
    for (std::uint32_t first = 0; first < count; first += size_.resume_slots) {
        ActiveRays active = {first, std::min(size_.resume_slots, count - first), true};
        std::uint64_t rounds_left = most_rounds;
        for (bool unfinished = true; unfinished; active.is_fresh = false) {
            if (rounds_left-- == 0)
                throw Error(ErrorKind::kInternal, "Vulkan: the device never ends a traversal");
            device_ms += submit_pass(what, Reset::kUnfinished,
                                     [&](VkCommandBuffer commands) { dispatch(commands, active); });
            unfinished = header().unfinished_count != 0;
        }
    }
    return device_ms;
}

}  // namespace mray::gpu
