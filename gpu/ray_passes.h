// Dispatches over rays, and the buffers of their answers.
#pragma once

#include <cstdint>
#include <functional>

#include "gpu/kernels.h"
#include "gpu/scene_buffers.h"
#include "gpu/vulkan/limits.h"

namespace mray::gpu {

/// One dispatch of rays.
struct RayPass {
    /// For errors: a verb with its object.
    const char* what;
    /// Whether the rays need any hit instead of the closest.
    bool any_hit;
    Record dispatch;
    /// Dispatches the rays that `dispatch` marked as unfinished; empty if it marks none.
    Record rest;
    /// The kernel of `rest`.
    Kernel* rest_kernel = nullptr;
};

/// Buffers for the rays of one dispatch, and the loop that brings each ray to an answer.
class RayPasses {
public:
    RayPasses(Context& context, const PassSize& size, std::uint32_t step_budget);

    const PassSize& size() const { return size_; }
    const Buffer& hits() const { return hits_.buffer; }
    const Buffer& occlusion() const { return occlusion_.buffer; }
    const Buffer& pixels() const { return pixels_; }
    const Buffer& rays() const { return rays_.buffer; }
    const Buffer& visible_pixels() const { return visible_pixels_.buffer; }
    void add_to(Bindings& bindings) const;

    /// Records a pass. The first pass of a submission is number 0.
    void record(VkCommandBuffer commands, const RayPass& pass, std::uint32_t number) const;
    /// Whether pass `number` of the last submission has left rays without an answer.
    bool is_incomplete(const RayPass& pass, std::uint32_t number) const;
    /// Brings the rays that the last pass of that submission left to an answer, with `rest` and
    /// rounds of `resume`. Returns milliseconds on the device. Throws Error(kInternal) if a tree is
    /// broken.
    double complete(const RayPass& pass, std::uint32_t number, Kernels& kernels,
                    const SceneBuffers& scene);
    /// Submits a pass by itself and completes it. Returns milliseconds on the device.
    double run(const RayPass& pass, Kernels& kernels, const SceneBuffers& scene);

    /// Submits `dispatch`, which asks as `arguments` say, and again, with arguments of its own,
    /// until all questions have answers. Returns the pairs that it found
    /// (WorkHeader::visible_count). Throws Error(kInternal) if a tree is broken.
    std::uint32_t ask(const char* what, const SceneBuffers& scene, QuestionArguments& arguments,
                      const Record& dispatch);

    /// Submits a dispatch of `compact`. Returns milliseconds on the device, and the number of
    /// visible pixels in `visible_count`.
    double compact(const Record& dispatch, std::uint32_t& visible_count);

    /// Most passes of one submission.
    static constexpr std::uint32_t kMostPasses = 2;

private:
    /// The counters that a dispatch begins with at 0.
    enum class Reset { kAll, kUnfinished };
    void record_part(VkCommandBuffer commands, Reset reset, const Record& dispatch,
                     std::uint32_t number) const;
    WorkHeader header(const char* what, std::uint32_t number) const;
    double resume(Kernels& kernels, const SceneBuffers& scene, bool any_hit, std::uint32_t count);

    Context& context_;
    PassSize size_;
    std::uint32_t step_budget_;
    TexelBuffer rays_;
    TexelBuffer hits_;
    TexelBuffer visible_pixels_;
    TexelBuffer occlusion_;
    Buffer pixels_;
    Buffer work_;
    Buffer states_;
    /// A WorkHeader of each pass of a submission, for the host.
    Buffer headers_;
};

}  // namespace mray::gpu
