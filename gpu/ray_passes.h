// Dispatches over rays, and the memory of their answers.
#pragma once

#include <cstdint>
#include <functional>

#include "gpu/kernels.h"
#include "gpu/scene_buffers.h"
#include "gpu/vulkan/limits.h"

namespace morphray::gpu {

/// One dispatch of rays.
struct RayPass {
    /// For errors: what it is there to do.
    const char* what;
    /// What the rays ask for.
    bool any_hit;
    Record dispatch;
    /// Dispatches rays that `dispatch` marked as unfinished, if it can.
    Record rest;
};

/// Buffers for one dispatch's worth of rays, and the loop that brings each of them to an answer.
class RayPasses {
public:
    RayPasses(Context& context, const PassSize& size, std::uint32_t step_budget);

    const PassSize& size() const { return size_; }
    const Buffer& hits() const { return hits_.buffer; }
    const Buffer& occlusion() const { return occlusion_.buffer; }
    const Buffer& pixels() const { return pixels_; }
    const Buffer& rays() const { return rays_.buffer; }
    void add_to(Bindings& bindings) const;

    /// Records a pass. Of those that one submission holds, the first is number 0.
    void record(VkCommandBuffer commands, const RayPass& pass, std::uint32_t number) const;
    /// Whether pass `number` of the submission that ended last has left rays without an answer.
    bool is_incomplete(const RayPass& pass, std::uint32_t number) const;
    /// Brings those of the last pass of that submission to an answer (or those that it marked as
    /// unfinished), in as many rounds of `resume` as it takes. Returns the time on the device in
    /// milliseconds. Throws Error(kInternal) rather than leave a wrong answer.
    double complete(const RayPass& pass, std::uint32_t number, const Kernels& kernels,
                    const SceneBuffers& scene);
    /// Submits a pass by itself and completes it; likewise.
    double run(const RayPass& pass, const Kernels& kernels, const SceneBuffers& scene);

    /// Runs a dispatch of `select`. seen_count: the pixels that it listed.
    double select(const Record& dispatch, std::uint32_t& seen_count);

    /// Of one submission.
    static constexpr std::uint32_t kMostPasses = 2;

private:
    void record_part(VkCommandBuffer commands, VkDeviceSize reset_offset, const Record& dispatch,
                     std::uint32_t number) const;
    WorkHeader header(const char* what, std::uint32_t number) const;
    double resume(const Kernels& kernels, const SceneBuffers& scene, bool any_hit,
                  std::uint32_t count);

    Context& context_;
    PassSize size_;
    std::uint32_t step_budget_;
    TexelBuffer rays_;
    TexelBuffer hits_;
    TexelBuffer seen_;
    TexelBuffer occlusion_;
    Buffer pixels_;
    Buffer work_;
    Buffer states_;
    /// Of each pass.
    Buffer headers_;
};

}  // namespace morphray::gpu
