// Rows of samples from hits to colours.
#include "cpu/image/lit_shader.h"

#include <algorithm>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/image/lit_shader.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/image/lit_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// The details of pixels from those of their samples.
class PixelDetails {
public:
    PixelDetails(std::uint32_t side, std::size_t width) : side_(side), pixels_(width) {}

    void clear() { std::fill(pixels_.begin(), pixels_.end(), LitPixel{}); }

    /// Adds row `k` of the samples of the pixels.
    void add(const LitRows& rows, std::uint32_t k) {
        for (std::size_t x = 0; x < pixels_.size(); ++x) {
            LitPixel& pixel = pixels_[x];
            for (std::size_t plane = 0; plane < 3; ++plane) {
                for (std::size_t i = 0; i < side_; ++i)
                    pixel.colour[plane] += rows.detail(plane)[x * side_ + i];
            }
            if (k != side_ / 2) continue;
            const std::size_t middle = x * side_ + side_ / 2;
            for (std::size_t i = 0; i < 3; ++i) pixel.normal[i] = rows.detail(3 + i)[middle];
            pixel.open = rows.detail(6)[middle];
        }
    }

    void write(LitPixel* to) const {
        const float share = 1.0f / static_cast<float>(side_ * side_);
        for (const LitPixel& pixel : pixels_) {
            *to = pixel;
            for (float& channel : to->colour) channel *= share;
            ++to;
        }
    }

private:
    std::size_t side_;
    std::vector<LitPixel> pixels_;
};

void shade_lit_rows(const LitSamples& samples, std::uint32_t begin, std::uint32_t end,
                    std::uint32_t* pixels, LitPixel* details) {
    const std::uint32_t side = samples.side;
    const std::size_t width = samples.params.width / side;
    const bool with_details = details != nullptr && samples.kind == LitKind::kLit;
    LitRows rows(samples, begin * side, end * side, with_details);
    PixelSums sums(samples.params.width, side);
    PixelDetails means(side, with_details ? width : 0);
    for (std::uint32_t y = begin; y < end; ++y, pixels += width) {
        sums.clear();
        means.clear();
        for (std::uint32_t k = 0; k < side; ++k) {
            const std::uint32_t* const colours = rows.shade(y * side + k);
            if (side == 1) {
                std::copy_n(colours, width, pixels);
            } else {
                sums.add(colours, samples.params.width);
            }
            if (with_details) means.add(rows, k);
        }
        if (side > 1) sums.write(width, pixels);
        if (with_details) {
            means.write(details);
            details += width;
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(find_flat_shadows_of_row);
HWY_EXPORT(shade_lit_rows);

}  // namespace

LitShader::LitShader(SimdTarget target)
    : shade_rows(SIMD_FUNCTION(shade_lit_rows, target)),
      find_flat_shadows(SIMD_FUNCTION(find_flat_shadows_of_row, target)) {}

}  // namespace mray::cpu

#endif  // HWY_ONCE
