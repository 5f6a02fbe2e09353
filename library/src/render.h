// Images, from a backend that traces them: plain ones here, all others in lit_image.h.
#pragma once

#include <mutex>
#include <utility>

#include "common/image/frame.h"
#include "common/interop/camera.h"
#include "morphray/images.hpp"

namespace morphray::detail {

struct TracedImage {
    /// Of the samples: width and height are those of the image times a pixel's side.
    mray::ImageParams params = {};
    mray::Frame samples;
    /// `samples` with ambient-occlusion rays, if `has_sky`; else those of an image before.
    mray::Frame sky;
    bool has_sky = false;
};

/// Memory of an image, which the next one uses again. Thread-safe.
class ImageMemory {
public:
    TracedImage take() {
        const std::scoped_lock lock(mutex_);
        return std::exchange(spare_, {});
    }
    void give_back(TracedImage image) {
        // The most samples that are kept: 340 MB with the sky's.
        constexpr std::size_t kMostSamples = std::size_t{1} << 23;
        if (image.samples.hits.size() > kMostSamples) return;
        const std::scoped_lock lock(mutex_);
        spare_ = std::move(image);
    }

private:
    std::mutex mutex_;
    TracedImage spare_;
};

}  // namespace morphray::detail
