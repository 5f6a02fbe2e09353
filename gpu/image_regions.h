// The regions of an image, each the work of a submission, and the way of their results to the host.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "common/base/watch.h"
#include "gpu/vulkan/memory.h"
#include "shaders/kernel_interface.h"

namespace mray::gpu {

/// Finds how much a device does in tens of milliseconds: no submission can be interrupted.
class Pace {
public:
    explicit Pace(std::uint32_t first) : amount_(first) {}

    /// The amount for the next submission, from 1 to `most`, which it is if nobody may cancel.
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

}  // namespace mray::gpu
