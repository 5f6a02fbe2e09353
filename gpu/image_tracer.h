// An image, region by region.
#pragma once

#include <vector>

#include "common/backend.h"
#include "gpu/kernels.h"
#include "gpu/ray_passes.h"
#include "gpu/scene_buffers.h"
#include "gpu/vulkan/transfer.h"

namespace morphray::gpu {

/// Traces and shades in one submission a region, as far as the host need not look at what came out.
/// What it is given outlives it, and is bound.
class ImageTracer {
public:
    ImageTracer(Context& context, Transfer& transfer, const Kernels& kernels, RayPasses& passes,
                const SceneBuffers& scene)
        : context_(context),
          transfer_(transfer),
          kernels_(kernels),
          passes_(passes),
          scene_(scene) {}

    /// Submits the first region, with what was deferred. The frame must outlive the call of end().
    void begin(const ImageParams& params, Frame& frame);
    /// Whether begin() has been called and not end().
    bool is_under_way() const { return frame_ != nullptr; }
    /// Waits for that region and traces the others. The frame is whole then, and `times` has what
    /// tracing took.
    void end(BackendTimes& times);

private:
    void begin_region(const RegionArguments& region, Deferred deferred);
    void end_region(const RegionArguments& region, BackendTimes& times);
    bool is_one_submission(const ImageParams& params) const;
    void separate(VkCommandBuffer commands);
    RayPass camera_pass(const RegionArguments& region) const;
    RayPass shadow_pass(const RegionArguments& region) const;
    Record shading(const RegionArguments& region) const;
    std::uint32_t packet_groups(std::uint32_t packets) const;
    double trace_listed(const RegionArguments& region);
    void copy_region(const RegionArguments& region, Frame& frame);

    Context& context_;
    Transfer& transfer_;
    const Kernels& kernels_;
    RayPasses& passes_;
    const SceneBuffers& scene_;
    Frame* frame_ = nullptr;
    std::vector<RegionArguments> regions_;
};

}  // namespace morphray::gpu
