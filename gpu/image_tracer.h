// An image, region by region.
#pragma once

#include <cstdint>
#include <span>

#include "common/backend.h"
#include "gpu/image_regions.h"
#include "gpu/kernels.h"
#include "gpu/ray_passes.h"

namespace mray::gpu {

/// Traces and shades a region in one submission, unless rays are suspended or secondary rays exceed
/// a batch. The arguments of the constructor must outlive it, and the kernels must be bound.
class ImageTracer {
public:
    ImageTracer(Context& context, Kernels& kernels, RayPasses& passes)
        : context_(context), kernels_(kernels), passes_(passes) {}

    /// A watch can cancel between submissions, which then take tens of milliseconds.
    void trace(const ImageParams& params, Frame& frame, BackendTimes& times, const Watch& watch);

    /// Traces as many views as fit in one submission, and hands them over.
    void trace_views(const ViewBatch& views, BackendTimes& times, const Watch& watch);

    /// Traces the secondary rays of a region whose hits are there. The kernels must be ready.
    void trace_secondary(const RegionArguments& region, BackendTimes& times, const Watch& watch);

private:
    void prepare_kernels(const Watch& watch);
    double trace_regions(std::span<const RegionArguments> regions, std::uint32_t count);
    void trace_region(const RegionArguments& region, BackendTimes& times, const Watch& watch);
    void separate(VkCommandBuffer commands);
    void record_secondary(VkCommandBuffer commands, const RegionArguments& region,
                          std::uint32_t batch);
    bool finish_secondary(const RegionArguments& region, std::uint32_t batch,
                          const WorkHeader& header, BackendTimes& times, const Watch& watch);
    double trace_rest(const RegionArguments& region, std::uint32_t first, std::uint32_t ray_count,
                      const Watch& watch);
    void shade(VkCommandBuffer commands, const RegionArguments& region) const;
    void copy_results(VkCommandBuffer commands, const RegionArguments& region) const;
    void copy_region(const RegionArguments& region, Frame& frame) const;

    Context& context_;
    Kernels& kernels_;
    RayPasses& passes_;
    // Of the image that is traced.
    bool with_pixels_ = true;
    bool with_hits_ = true;
    /// HitWords that a kernel copies for the host, instead of whole hits.
    std::uint32_t packed_words_ = 0;
    /// Secondary rays of a visible pixel.
    std::uint32_t samples_ = 0;
    /// Tiles of a region, and secondary rays of a submission.
    Pace tiles_pace_{16};
    Pace rays_pace_{1u << 14};
};

}  // namespace mray::gpu
