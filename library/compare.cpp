#include "morphray/compare.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>

#include "library/errors.h"
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

std::string text_of(const Hit& hit) {
    if (!hit) return "a miss";
    return fmt::format("t {:.9g}, u {:.9g}, v {:.9g}, prim_id {}, geom_id {}", hit.t, hit.u, hit.v,
                       hit.prim_id, hit.geom_id);
}

}  // namespace

Comparison compare(const Scene& first, const Scene& second, std::span<const Ray> rays,
                   std::size_t keep) {
    return detail::with_public_errors([&] {
        std::vector<Hit> a(rays.size());
        std::vector<Hit> b(rays.size());
        first.intersect(rays, std::span<Hit>(a));
        second.intersect(rays, std::span<Hit>(b));
        return compare_all(
            rays.size(), keep, [&](std::size_t i) { return same_bits(a[i], b[i]); },
            [&](std::size_t i) {
                return HitDifference{i, a[i], b[i]};
            });
    });
}

Comparison compare(const Image& first, const Image& second, std::size_t keep) {
    return detail::with_public_errors([&] {
        const std::size_t count = first.pixels.size();
        const bool fit = first.width == second.width && first.height == second.height &&
                         count == second.pixels.size() && count == first.hits.size() &&
                         count == second.hits.size() && count == first.occlusion.size() &&
                         count == second.occlusion.size();
        if (!fit) detail::throw_bad_argument("compare: the images have different sizes");
        return compare_all(
            count, keep,
            [&](std::size_t i) {
                return same_bits(first.hits[i], second.hits[i]) &&
                       first.occlusion[i] == second.occlusion[i] &&
                       first.pixels[i] == second.pixels[i];
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
