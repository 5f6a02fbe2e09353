// The command line of the benchmark.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/scene/camera_setup.h"
#include "common/simd/simd_target.h"
#include "lab/bench/fill_view.h"

namespace mray::bench {

/// Few samples in works that trace a whole image, because the records of 16 samples would fill the
/// memory and take long to trace.
inline ViewSpec few_ao_samples() {
    ViewSpec view;
    view.ao_count = 2;
    return view;
}

inline constexpr const char* kWorks[] = {"primary", "shadow", "diffuse", "ao",   "one-ray",
                                         "refit",   "build",  "queries", "frame"};

/// Sets of built-in scenes.
struct SceneSet {
    const char* name;
    std::vector<std::string> scenes;
};
std::vector<SceneSet> scene_sets();

struct BenchOptions {
    /// Those of a set, then the given ones.
    std::vector<std::string> scenes = scene_sets().front().scenes;
    /// Elements of kWorks.
    std::vector<std::string> works = {"primary", "shadow", "diffuse", "ao",
                                      "one-ray", "refit",  "build"};
    /// Numbers of rays a pixel; the work "ao" is done for each.
    std::vector<std::uint32_t> ao_samples = {4};
    std::vector<int> threads = {1, 2};
    int repeat = 5;
    /// Best first.
    std::vector<SimdTarget> targets = {find_simd_target("best")};
    ViewKind view_kind = ViewKind::kFill;
    ViewSpec view = few_ao_samples();
    /// Settings of Embree's device in addition to the threads.
    std::string embree;
    std::string csv;
    bool help = false;

    bool wants(const std::string& work) const;
};

/// Throws Error: kBadArgument, kUnavailable (a SIMD target that this machine lacks).
BenchOptions parse_options(std::span<const std::string> arguments);

std::string usage();

}  // namespace mray::bench
