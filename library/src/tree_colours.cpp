#include "library/src/tree_colours.h"

#include <bit>
#include <iterator>

#include "common/interop/camera.h"
#include "common/interop/shading.h"
#include "cpu/reference/scalar_tracer.h"
#include "library/src/scene_impl.h"

namespace morphray::detail {
namespace {

/// A colour from dark blue over green to dark red (after A. Mikhailov. Turbo, an improved rainbow
/// colormap for visualization. 2019), in proportion to the logarithm of n: from 2^first to 2^last.
std::uint32_t heat_colour(std::uint32_t n, std::uint32_t first, std::uint32_t last) {
    // Red, green and blue at equal distances.
    static constexpr std::int32_t kStops[][3] = {{48, 18, 59},   {70, 134, 251}, {27, 229, 181},
                                                 {164, 252, 60}, {251, 185, 56}, {226, 66, 10},
                                                 {122, 4, 3}};
    constexpr std::int32_t kParts = std::size(kStops) - 1;
    // The logarithm in units of 2^-8, linear between powers of two.
    const std::uint32_t from = std::clamp(n, 1u << first, 1u << last);
    const auto power = static_cast<std::uint32_t>(std::bit_width(from)) - 1;
    const auto fraction = static_cast<std::uint32_t>((std::uint64_t{from} << 8 >> power) & 255);
    const auto range = static_cast<std::int32_t>((last - first) << 8);
    const auto along = static_cast<std::int32_t>(((power - first) << 8) + fraction) * kParts;
    const std::int32_t part = std::min(along / range, kParts - 1);
    const std::int32_t rest = along - part * range;
    std::uint32_t channels[3];
    for (int k = 0; k < 3; ++k) {
        const std::int32_t a = kStops[part][k];
        const std::int32_t b = kStops[part + 1][k];
        channels[k] = static_cast<std::uint32_t>(a + (b - a) * rest / range);
    }
    return mray::pack_rgb(channels[0], channels[1], channels[2]);
}

}  // namespace

void colour_by_tree(SceneImpl& scene, Shading shading, const mray::Watch& watch,
                    TracedImage& image) {
    const mray::Bvh& tree = scene.tracer().host_tree();
    const bool is_steps = shading == Shading::steps;
    const std::vector<float> looseness =
        is_steps ? std::vector<float>() : mray::cpu::leaf_looseness(tree);
    const std::uint32_t width = image.params.width;
    const auto colour = [&](std::uint32_t x, std::uint32_t y, const mray::Hit& hit) {
        if (is_steps) {
            const mray::Ray ray = mray::camera_ray(image.params.camera, x, y);
            return heat_colour(mray::cpu::count_steps(tree, ray, hit), 0, 6);
        }
        if (hit.prim_id == mray::kNoPrim) return 0xFF000000u;
        // Loosenesses from 1 to 16 differ.
        const float loose = std::min(looseness[hit.prim_id], 1024.0f);
        return heat_colour(static_cast<std::uint32_t>(loose * 16.0f), 4, 8);
    };
    mray::resize_watched(image.samples.pixels, image.samples.hits.size(), watch);
    scene.arena().execute([&] {
        tbb::parallel_for(std::uint32_t{0}, image.params.height, [&](std::uint32_t y) {
            watch.throw_if_cancelled();
            for (std::uint32_t x = 0; x < width; ++x) {
                const std::size_t i = std::size_t{y} * width + x;
                image.samples.pixels[i] = colour(x, y, image.samples.hits[i]);
            }
        });
    });
}

}  // namespace morphray::detail
