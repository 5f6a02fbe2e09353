// Lit images and false colours, region by region, whole on the device.
#pragma once

#include "common/backend.h"
#include "gpu/image_tracer.h"
#include "gpu/kernels.h"
#include "gpu/ray_passes.h"

namespace mray::gpu {

/// Traces the samples of a region as ImageTracer does, and shades its pixels. The arguments of the
/// constructor must outlive it, and the kernels must be bound.
class LitTracer {
public:
    LitTracer(Context& context, Kernels& kernels, RayPasses& passes, ImageTracer& images)
        : context_(context), kernels_(kernels), passes_(passes), images_(images) {}

    /// Whether a submission has room for regions of lit images.
    bool has_room() const;
    /// As Backend::trace_lit(), with the normals in the scene's buffers.
    void trace(const LitView& view, Frame& samples, std::span<std::uint32_t> pixels,
               std::span<LinearColour> linear, BackendTimes& times, const Watch& watch);

private:
    /// The samples that are traced, and the pixels that are made of them.
    struct Region {
        RegionArguments traced;
        LitArguments shaded;
    };

    void prepare_kernels(const LitView& view, const Watch& watch);
    std::uint64_t trace_region(const LitView& view, const Region& region, BackendTimes& times,
                               const Watch& watch);
    std::uint64_t light_smooth_surfaces(const Region& region, BackendTimes& times);
    std::uint32_t shade(const Region& region, bool with_hits, BackendTimes& times);
    void copy_region(const LitView& view, const Region& region, Frame& samples,
                     std::uint32_t* pixels, LinearColour* linear) const;

    Context& context_;
    Kernels& kernels_;
    RayPasses& passes_;
    ImageTracer& images_;
    Pace tiles_pace_{16};
};

}  // namespace mray::gpu
