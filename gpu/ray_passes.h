// Dispatches over rays, and the buffers of their answers.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

#include "gpu/kernels.h"
#include "gpu/limits.h"
#include "gpu/scene_buffers.h"

namespace mray::gpu {

/// How many results of each kind the host needs.
struct ResultCounts {
    std::uint32_t hits = 0;
    std::uint32_t occlusion = 0;
    std::uint32_t pixels = 0;
    std::uint32_t linear = 0;
};

/// Brings each ray of a dispatch to an answer, with the buffers of a call.
class RayPasses {
public:
    /// Kernels and scene must outlive it.
    RayPasses(SharedDevice& device, Context& context, Kernels& kernels, const SceneBuffers& scene,
              const PassSize& size);

    struct GiveBack {
        void operator()(RayPasses* passes) const {
            passes->device_.ray_buffers.give_back(std::move(passes->buffers_));
        }
    };
    using Use = std::unique_ptr<RayPasses, GiveBack>;
    /// Lends buffers of the device for the other calls. Throws Error(kLimit) if memory runs out.
    [[nodiscard]] Use use();

    const PassSize& size() const { return size_; }
    /// The buffers in use, or null.
    const RayBuffers* buffers() const { return buffers_.get(); }

    /// Records, before the first pass of a submission, that the counters become 0.
    void begin(VkCommandBuffer commands) const { reset(commands, Reset::kAll); }
    /// Records, after the last pass of a submission, the copy of its counters for header().
    void end(VkCommandBuffer commands) const;
    /// Records the copy of the first results to buffers that the host sees.
    void copy_results(VkCommandBuffer commands, const ResultCounts& counts) const;
    /// The counters of the last submission.
    WorkHeader header() const;
    /// Brings the first `count` suspended rays to an answer, the closest or any hit. Returns
    /// milliseconds on the device.
    double resume(bool any_hit, std::uint32_t count);
    /// Records, after a dispatch over at most `count` rays, that their open triangles are decided.
    void decide(VkCommandBuffer commands, bool any_hit, std::uint32_t count) const;
    /// Submits `dispatch` of `count` rays by itself, over listed pixels if there are any, and
    /// answers all of them. `what` is a verb with its object, for errors. Returns milliseconds on
    /// the device.
    double run(const char* what, bool any_hit, std::uint32_t count, const Record& dispatch);

    /// Submits a kernel of queries, and again until all queries have answers. Returns the pairs
    /// that it found (WorkHeader::visible_count).
    std::uint32_t answer(const char* what, QueryKernel& kernel, QueryArguments arguments);

private:
    /// The counters that a dispatch sets to 0; kRays: all but visible_count.
    enum class Reset { kAll, kRays, kUnfinished };
    void reset(VkCommandBuffer commands, Reset what) const;
    double submit_pass(const char* what, Reset reset, const Record& dispatch);

    /// Suspended rays or queries of a dispatch.
    struct ActiveRays {
        std::uint32_t first;
        std::uint32_t count;
        bool is_fresh;
    };
    double finish(const char* what, std::uint32_t count,
                  const std::function<void(VkCommandBuffer, const ActiveRays&)>& dispatch);

    SharedDevice& device_;
    Context& context_;
    Kernels& kernels_;
    const SceneBuffers& scene_;
    PassSize size_;
    std::unique_ptr<RayBuffers> buffers_;
};

}  // namespace mray::gpu
