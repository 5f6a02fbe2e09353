// Dispatches over rays, and the memory of their answers.
#pragma once

#include <cstdint>
#include <functional>

#include "gpu/kernels.h"
#include "gpu/limits.h"
#include "gpu/scene_buffers.h"

namespace morphray::gpu {

/// Buffers for one dispatch's worth of rays, and the loop that brings each of them to an answer.
class RayPasses {
public:
    RayPasses(Context& context, const PassSize& size, std::uint32_t step_budget);

    const PassSize& size() const { return size_; }
    const Buffer& hits() const { return hits_; }
    const Buffer& occlusion() const { return occlusion_; }
    const Buffer& pixels() const { return pixels_; }
    const Buffer& rays() const { return rays_.buffer; }
    void add_to(Bindings& bindings) const;

    /// Runs one dispatch of rays and, for those that ran out of steps, as many rounds of `resume`
    /// as it takes. any_hit: what the rays ask for. Returns the time on the device in
    /// milliseconds. Throws Error(kInternal) rather than leave a wrong answer.
    /// rest: dispatches rays that `dispatch` left unfinished, if it can.
    double run(const char* what, const Kernels& kernels, const SceneBuffers& scene, bool any_hit,
               const std::function<void(VkCommandBuffer)>& dispatch,
               const std::function<void(VkCommandBuffer)>& rest = {});

    /// Runs a dispatch of `select`. seen_count: the pixels that it listed.
    double select(const std::function<void(VkCommandBuffer)>& dispatch, std::uint32_t& seen_count);

private:
    struct Outcome {
        WorkHeader header;
        double device_ms;
    };
    Outcome submit(const char* what, VkDeviceSize reset_offset,
                   const std::function<void(VkCommandBuffer)>& dispatch);
    double resume(const Kernels& kernels, const SceneBuffers& scene, bool any_hit,
                  std::uint32_t count);

    Context& context_;
    PassSize size_;
    std::uint32_t step_budget_;
    TexelBuffer rays_;
    Buffer hits_;
    TexelBuffer seen_;
    Buffer occlusion_;
    Buffer pixels_;
    Buffer work_;
    Buffer states_;
    Buffer header_copy_;
};

}  // namespace morphray::gpu
