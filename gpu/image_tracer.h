// An image, region by region: each is the work of a submission, and its results go to the host.
#pragma once

#include <algorithm>
#include <span>

#include "common/backend.h"
#include "gpu/kernels.h"
#include "gpu/ray_passes.h"

namespace mray::gpu {

/// Finds how much a device does in tens of milliseconds: no submission can be interrupted.
class Pace {
public:
    explicit Pace(std::uint32_t first) : amount_(first) {}

    /// The amount for the next submission, from 1 to `most`; `most` if nobody can cancel.
    std::uint32_t next(std::uint32_t most, const Watch& watch) const {
        return watch.can_cancel() ? std::clamp(amount_, 1u, most) : most;
    }

    void took(std::uint32_t amount, double ms) {
        constexpr double kWantedMs = 40;
        // A time says little about larger amounts: regions of an image differ.
        constexpr double kMostGrowth = 4;
        const double factor = std::clamp(kWantedMs / std::max(ms, 1e-3), 0.0, kMostGrowth);
        constexpr double kMost = 1u << 30;
        amount_ = static_cast<std::uint32_t>(std::clamp(amount * factor, 1.0, kMost));
    }

private:
    std::uint32_t amount_;
};

inline void set_tiles(RegionArguments& region, std::uint32_t width, std::uint32_t height) {
    region.tile_columns = (region.width + width - 1) / width;
    region.tile_count = region.tile_columns * ((region.height + height - 1) / height);
}

/// Divides an image into regions of whole tiles, as wide as possible, row by row of regions.
class Regions {
public:
    explicit Regions(const ImageParams& params) : params_(params) {}

    bool has_next() const { return params_.width > 0 && y_ < params_.height; }

    /// The next region, of at most `tiles` tiles or as many as its row has begun with.
    RegionArguments next(std::uint32_t tiles) {
        const std::uint32_t columns = (params_.width + kTileSize - 1) / kTileSize;
        if (x_ == 0) rows_ = tiles / std::min(tiles, columns);
        const std::uint32_t width = std::max(tiles / rows_, 1u) * kTileSize;
        RegionArguments region = {.params = params_,
                                  .x = x_,
                                  .y = y_,
                                  .width = std::min(width, params_.width - x_),
                                  .height = std::min(rows_ * kTileSize, params_.height - y_)};
        set_tiles(region, kTileSize, kTileSize);
        x_ += region.width;
        if (x_ == params_.width) {
            x_ = 0;
            y_ += region.height;
        }
        return region;
    }

private:
    const ImageParams& params_;
    std::uint32_t x_ = 0;
    std::uint32_t y_ = 0;
    /// Rows of tiles of this row of regions.
    std::uint32_t rows_ = 1;
};

/// The elements of `buffer`, or of its copy for the host.
template <class T>
const T* seen_by_host(const Buffer& buffer, const Buffer& copy) {
    const Buffer& seen = buffer.mapped().empty() ? copy : buffer;
    return reinterpret_cast<const T*>(seen.mapped().data());
}

/// A rectangle of an image, and where its rows are in a buffer.
struct CopiedRows {
    std::uint32_t x, y, width, height;
    std::size_t first, pitch;
};

/// Copies a rectangle of `buffer`, or of its copy for the host, to the image.
template <class T>
void copy_rows(const Buffer& buffer, const Buffer& copy, const CopiedRows& rows,
               std::uint32_t image_width, T* to) {
    const T* const from = seen_by_host<T>(buffer, copy) + rows.first;
    for (std::uint32_t y = 0; y < rows.height; ++y) {
        std::copy_n(from + y * rows.pitch, rows.width,
                    to + std::size_t{rows.y + y} * image_width + rows.x);
    }
}

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
