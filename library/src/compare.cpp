#include "morphray/compare.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>

#include "library/src/scene/errors.h"
#include "morphray/scene.hpp"

namespace morphray {
namespace {

bool same_bits(const Hit& a, const Hit& b) {
    using Bits = std::array<std::uint32_t, sizeof(Hit) / sizeof(std::uint32_t)>;
    return std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b);
}

/// Compares items 0 to count - 1; `same(i)` tells whether one is equal, `difference(i)` what
/// differs.
template <class Same, class Difference>
Comparison compare_all(std::size_t count, std::size_t keep, Same same, Difference difference) {
    Comparison comparison;
    comparison.compared = count;
    for (std::size_t i = 0; i < count; ++i) {
        if (same(i)) continue;
        ++comparison.different;
        if (comparison.differences.size() < keep) comparison.differences.push_back(difference(i));
    }
    return comparison;
}

/// Camera rays of an image, of which a pixel may have a square of several.
class SampleGrid {
public:
    explicit SampleGrid(const Image& image)
        : width_(image.width), side_(sample_side(image.samples)) {}

    /// Whether the pixel of sample i has the same colour in both; true but for its first sample.
    bool same_pixel(std::size_t i, const Image& first, const Image& second) const {
        const std::size_t row = std::size_t{width_} * side_;
        const std::size_t x = i % row;
        const std::size_t y = i / row;
        if (x % side_ != 0 || y % side_ != 0) return true;
        const std::size_t pixel = y / side_ * width_ + x / side_;
        return first.pixels[pixel] == second.pixels[pixel];
    }

private:
    std::uint32_t width_;
    std::uint32_t side_;
};

std::string text_of(const Hit& hit) {
    if (!hit) return "a miss";
    return fmt::format("t {:.9g}, u {:.9g}, v {:.9g}, prim_id {}, geom_id {}", hit.t, hit.u, hit.v,
                       hit.prim_id, hit.geom_id);
}

}  // namespace

Comparison compare(const Scene& first, const Scene& second, std::span<const Ray> rays,
                   std::size_t keep, const std::atomic<bool>* cancel) {
    return detail::with_public_errors([&] {
        std::vector<Hit> a(rays.size());
        std::vector<Hit> b(rays.size());
        first.intersect(rays, std::span<Hit>(a), Coherence::none(), cancel);
        second.intersect(rays, std::span<Hit>(b), Coherence::none(), cancel);
        return compare_all(
            rays.size(), keep, [&](std::size_t i) { return same_bits(a[i], b[i]); },
            [&](std::size_t i) {
                return HitDifference{i, a[i], b[i]};
            });
    });
}

Comparison compare(const Image& first, const Image& second, std::size_t keep) {
    return detail::with_public_errors([&] {
        const std::size_t count = first.hits.size();
        const SampleGrid grid(first);
        const std::size_t side = sample_side(first.samples);
        const std::size_t pixels = std::size_t{first.width} * first.height;
        const bool fit = first.width == second.width && first.height == second.height &&
                         first.samples == second.samples && first.samples == side * side &&
                         pixels == first.pixels.size() && pixels == second.pixels.size() &&
                         count == pixels * first.samples && count == second.hits.size() &&
                         count == first.occlusion.size() && count == second.occlusion.size();
        if (!fit)
            detail::throw_bad_argument("compare: the images have different sizes, or no hits");
        return compare_all(
            count, keep,
            [&](std::size_t i) {
                return same_bits(first.hits[i], second.hits[i]) &&
                       first.occlusion[i] == second.occlusion[i] &&
                       grid.same_pixel(i, first, second);
            },
            [&](std::size_t i) {
                return HitDifference{i, first.hits[i], second.hits[i]};
            });
    });
}

std::string describe(const Comparison& comparison) {
    return detail::with_public_errors([&] {
        if (comparison.equal()) return fmt::format("{} equal", comparison.compared);
        std::string text =
            fmt::format("{} of {} differ", comparison.different, comparison.compared);
        for (const HitDifference& d : comparison.differences)
            text += fmt::format("\n{}: {}; {}", d.index, text_of(d.first), text_of(d.second));
        return text;
    });
}

}  // namespace morphray
