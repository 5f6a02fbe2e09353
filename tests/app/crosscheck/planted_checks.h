// Cross-checks with planted differences.
#pragma once

#include <cmath>
#include <random>
#include <string>

#include "app/report/check_report.h"

namespace mray::test {

/// An image of hits, every third pixel a miss, in noise.
inline Frame numbered_frame(std::uint32_t width, std::uint32_t height) {
    Frame frame{width, height, {}, {}, {}};
    std::mt19937 random(1);
    for (std::uint32_t i = 0; i < width * height; ++i) {
        frame.hits.push_back(i % 3 == 0 ? no_hit() : Hit{1.5f, 0.25f, 0.5f, i});
        frame.occlusion.push_back(i % 3 == 0 ? 0 : i % 5);
        frame.pixels.push_back(0xFF000000u | static_cast<std::uint32_t>(random()));
    }
    return frame;
}

/// The options of a check of one scene.
inline app::CrosscheckOptions options_of(const std::string& spec, std::uint32_t side) {
    app::CrosscheckOptions options;
    options.scenes = {spec};
    options.source.scene = spec;
    options.view.width = options.view.height = side;
    options.arguments = {"crosscheck", "x"};
    return options;
}

/// One scene of `frames` frames on two backends, three kinds of rays each. Of Vulkan's images of
/// frames from `first_wrong` on, some pixels differ.
inline app::Json planted_run(int frames, int first_wrong, std::uint32_t side,
                             const std::string& spec = "a&b <\"'scene'> </script>.obj") {
    const Frame expected = numbered_frame(side, side);
    Frame wrong = expected;
    wrong.hits[side + 1].t = std::nextafter(wrong.hits[side + 1].t, 2.0f);
    wrong.hits[2 * side + 2] = no_hit();
    wrong.hits[3 * side] = Hit{2, 0, 0, 7};
    wrong.hits[3 * side + 5].prim_id += 3;
    wrong.pixels[4 * side + 4] ^= 0x10;
    const app::CrosscheckOptions options = options_of(spec, side);
    app::Json run = app::empty_report(options);
    run["environment"]["simd"] = {"avx2", "scalar"};
    app::Json& scene = run["scenes"][0];
    for (int frame = 0; frame < frames; ++frame) {
        const double number = frame;
        scene["frames"].push_back(number);
        for (const char* backend : {"vulkan", "cpu"}) {
            for (const auto rays :
                 {morphray::Rays::primary, morphray::Rays::shadow, morphray::Rays::ao}) {
                const bool differs = *backend == 'v' && frame >= first_wrong;
                app::add_images(scene, options,
                                {{backend, "", "refit", "cpu"}, number, rays, "brute"}, expected,
                                differs ? wrong : expected);
            }
        }
        app::add_trees(scene, number, 5, 5);
    }
    scene["complete"] = true;
    app::conclude(run, "");
    return run;
}

}  // namespace mray::test
