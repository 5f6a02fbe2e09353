#include "morphray/images.hpp"

#include <fmt/format.h>

#include <cstring>

#include "library/src/scene/errors.h"
#include "morphray/scene.hpp"

namespace morphray {
namespace {

bool same_bits(const Hit& a, const Hit& b) { return std::memcmp(&a, &b, sizeof(Hit)) == 0; }

/// Compares as many hits of both; same(i) tells whether what belongs to hit i is equal, too.
template <class Same>
Comparison compare_all(std::span<const Hit> first, std::span<const Hit> second, std::size_t keep,
                       Same same) {
    Comparison comparison;
    comparison.compared = first.size();
    for (std::size_t i = 0; i < first.size(); ++i) {
        if (same_bits(first[i], second[i]) && same(i)) continue;
        ++comparison.different;
        if (comparison.differences.size() < keep)
            comparison.differences.push_back({i, first[i], second[i]});
    }
    return comparison;
}

std::string text_of(const Hit& hit) {
    if (!hit) return "a miss";
    return fmt::format("t {:.9g}, u {:.9g}, v {:.9g}, prim_id {}, geom_id {}", hit.t, hit.u, hit.v,
                       hit.prim_id, hit.geom_id);
}

}  // namespace

Comparison compare(const Scene& first, const Scene& second, std::span<const Ray> rays,
                   std::size_t keep, const QueryOptions& options) {
    return detail::with_public_errors([&] {
        std::vector<Hit> a(rays.size());
        std::vector<Hit> b(rays.size());
        first.intersect(rays, std::span<Hit>(a), options);
        second.intersect(rays, std::span<Hit>(b), options);
        return compare_all(a, b, keep, [](std::size_t) { return true; });
    });
}

Comparison compare(const Image& first, const Image& second, std::size_t keep) {
    return detail::with_public_errors([&] {
        const std::size_t count = first.hits.size();
        const std::size_t side = sample_side(first.samples);
        const std::size_t row = first.width * side;
        const std::size_t pixels = std::size_t{first.width} * first.height;
        const bool fit = first.width == second.width && first.height == second.height &&
                         first.samples == second.samples && first.samples == side * side &&
                         pixels == first.pixels.size() && pixels == second.pixels.size() &&
                         count == pixels * first.samples && count == second.hits.size() &&
                         count == first.occlusion.size() && count == second.occlusion.size();
        if (!fit)
            detail::throw_bad_argument("compare: the images have different sizes, or no hits");
        // A pixel counts with its first sample.
        const auto same_pixel = [&](std::size_t x, std::size_t y) {
            if (x % side != 0 || y % side != 0) return true;
            const std::size_t pixel = y / side * first.width + x / side;
            return first.pixels[pixel] == second.pixels[pixel];
        };
        return compare_all(first.hits, second.hits, keep, [&](std::size_t i) {
            return first.occlusion[i] == second.occlusion[i] && same_pixel(i % row, i / row);
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
