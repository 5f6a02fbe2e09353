// From the colours of samples to those of pixels.
#if defined(MORPHRAY_CPU_IMAGE_PIXEL_SUMS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_IMAGE_PIXEL_SUMS_INL_H
#undef MORPHRAY_CPU_IMAGE_PIXEL_SUMS_INL_H
#else
#define MORPHRAY_CPU_IMAGE_PIXEL_SUMS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "common/base/aligned_vector.h"
#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// The squares of 8-bit channels, which are linear intensities, summed over the samples of pixels.
class PixelSums {
public:
    PixelSums(std::size_t width, std::uint32_t side) : side_(side) {
        for (auto& plane : sums_) plane.resize((width + kLanes - 1) / kLanes * kLanes + 2 * kLanes);
    }

    void clear() {
        for (auto& plane : sums_) std::fill(plane.begin(), plane.end(), 0u);
    }

    void add(const std::uint32_t* colours, std::size_t width) {
        for (std::size_t x = 0; x < width; x += kLanes) {
            const UintVec colour = load_unaligned(colours + x);
            for (std::uint32_t k = 0; k < 3; ++k) {
                const UintVec channel = (colour >> (8 * k)) & 0xFFu;
                std::uint32_t* const at = sums_[k].data() + x;
                store_unaligned(load_unaligned(at) + channel * channel, at);
            }
        }
    }

    /// Writes the mean colours of `width` pixels.
    void write(std::size_t width, std::uint32_t* pixels) {
        for (std::uint32_t pairs = side_; pairs > 1; pairs /= 2) {
            const std::size_t count = width * (pairs / 2);
            for (auto& plane : sums_) {
                std::uint32_t* const at = plane.data();
                for (std::size_t x = 0; x < count; x += kLanes) {
                    UintVec even, odd;
                    hn::LoadInterleaved2(kUints, at + 2 * x, even, odd);
                    store_unaligned(even + odd, at + x);
                }
            }
        }
        const float share = 1.0f / static_cast<float>(side_ * side_);
        for (std::size_t x = 0; x < width; x += kLanes) {
            UintVec channels[3];
            for (std::uint32_t k = 0; k < 3; ++k) {
                channels[k] = lanes::root_of_mean(
                    lanes::to_float(load_unaligned(sums_[k].data() + x)) * share);
            }
            const UintVec colour = lanes::pack_rgb(channels[0], channels[1], channels[2]);
            if (width - x >= kLanes) {
                store_unaligned(colour, pixels + x);
            } else {
                alignas(64) std::uint32_t last[kLanes];
                store(colour, last);
                std::copy_n(last, width - x, pixels + x);
            }
        }
    }

private:
    std::uint32_t side_;
    AlignedVector<std::uint32_t> sums_[3];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
