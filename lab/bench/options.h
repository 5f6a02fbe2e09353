// What the command lines of the benchmark can say, and the programs that take them.
#pragma once

#include "common/simd/simd_target.h"

namespace mray::lab {

struct BenchOptions {
    std::vector<std::string> scenes = {"builtin:spikes:70000", "builtin:spikes:1000000",
                                       "builtin:cloth:180000", "builtin:herd:1000000",
                                       "builtin:hall"};
    std::vector<std::string> works = {"primary", "shadow", "diffuse", "ao",
                                      "one-ray", "refit",  "build"};
    std::vector<int> threads = {1, 2};
    int repeat = 5;
    /// Of a square image.
    std::uint32_t size = 1024;
    std::string csv;
    /// The shared objects of two builds, and instruction sets.
    std::string this_build, other_build;
    std::vector<std::string> simd = {best_simd_target().name};
    std::string line;
    /// Of the model: a card, and how far the eye is, or 0.
    std::string card = "H100";
    double distance = 0;

    bool wants(const std::string& work) const { return std::ranges::count(works, work) > 0; }
};

// Each measures all that is wanted, and returns the exit code.

/// Each work compares all methods of morphray with every peer.
int bench_beside_embree(const BenchOptions& options);
/// morphray on a Vulkan device beside the peer on the same device: camera, shadow and diffuse rays,
/// by the device's clock. `differ` counts rays that hit another triangle than by the peer's rule.
int bench_on_device(const BenchOptions& options);
/// What kernels would take on a GPU, by counts of what warps of sampled rays do: ours and the
/// peer's, as comma-separated values.
int model_gpu(const BenchOptions& options);
/// Two builds of this project trace in one process, in turn; 1 if an answer differs.
int compare_builds(const BenchOptions& options);

}  // namespace mray::lab
