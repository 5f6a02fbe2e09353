// Cross-checks with planted differences.
#pragma once

#include <cmath>
#include <random>
#include <string>

#include "app/report/crosscheck/check_report.h"

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

/// A comparison whose images are `expected` and `actual`.
inline app::CheckRow row_of(const std::string& backend, double frame, const std::string& rays,
                            const Frame& expected, const Frame& actual) {
    app::CheckRow row;
    row.frame = frame;
    row.backend = backend;
    row.update = "refit";
    row.refit_on = "cpu";
    row.rays = rays;
    row.reference = "brute";
    app::compare(expected, actual, row);
    return row;
}

/// One scene of `frames` frames on two backends, three kinds of rays each. Of Vulkan's images of
/// frames from `first_wrong` on, some pixels differ.
inline app::CheckRun planted_run(int frames, int first_wrong, std::uint32_t side,
                                 const std::string& spec = "a&b <\"'scene'> </script>.obj") {
    const Frame expected = numbered_frame(side, side);
    Frame wrong = expected;
    wrong.hits[side + 1].t = std::nextafter(wrong.hits[side + 1].t, 2.0f);
    wrong.hits[2 * side + 2] = no_hit();
    wrong.hits[3 * side] = Hit{2, 0, 0, 7};
    wrong.hits[3 * side + 5].prim_id += 3;
    wrong.pixels[4 * side + 4] ^= 0x10;
    app::CheckRun run;
    run.environment = {{}, {"avx2", "scalar"}, "morphray crosscheck x"};
    app::CheckReport& report = run.scenes.emplace_back();
    report.spec = spec;
    report.head = {"crosscheck", spec, 8, 9, side, side};
    for (int frame = 0; frame < frames; ++frame) {
        report.frames.push_back(frame);
        for (const char* backend : {"vulkan", "cpu"}) {
            for (const char* rays : {"primary", "shadow", "ao"}) {
                const bool differs = *backend == 'v' && frame >= first_wrong;
                const Frame& actual = differs ? wrong : expected;
                report.rows.push_back(row_of(backend, frame, rays, expected, actual));
            }
        }
        report.trees.push_back({static_cast<double>(frame), 5, 5});
    }
    return run;
}

}  // namespace mray::test
