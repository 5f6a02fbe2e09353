// The command line of the benchmark.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/scene/camera_setup.h"
#include "common/simd/simd_target.h"
#include "lab/bench/fill_view.h"

namespace mray::bench {

struct BenchOptions {
    /// Those of a set, then the given ones.
    std::vector<std::string> scenes;
    std::vector<std::string> works = {"primary", "shadow", "diffuse", "ao",
                                      "one-ray", "refit",  "build"};
    /// Numbers of rays a pixel; the work "ao" is done for each.
    std::vector<std::uint32_t> ao_samples = {4};
    std::vector<int> threads = {1, 2};
    int repeat = 5;
    /// Best first.
    std::vector<SimdTarget> targets;
    ViewKind view_kind = ViewKind::kFill;
    ViewSpec view;
    /// Settings of Embree's device in addition to the threads.
    std::string embree;
    std::string csv;
    /// The text that --help asks for, else empty.
    std::string help;

    bool wants(const std::string& work) const;
};

/// Throws Error: kBadArgument, kUnavailable (a SIMD target that this machine lacks).
BenchOptions parse_options(std::span<const std::string> arguments);

}  // namespace mray::bench
