// The command lines of the benchmark and of the comparison of two builds.
#pragma once

#include "common/scene/camera_setup.h"
#include "common/simd/simd_target.h"

namespace mray::lab {

struct BenchOptions {
    std::vector<std::string> scenes = {"builtin:spikes:70000", "builtin:cloth:180000",
                                       "builtin:herd:1000000", "builtin:hall"};
    std::vector<std::string> works = {"primary", "shadow", "diffuse", "ao",
                                      "one-ray", "refit",  "build"};
    std::vector<int> threads = {1, 2};
    int repeat = 5;
    /// A square.
    ViewSpec view;
    std::string csv;
    /// The shared objects of two builds, and instruction sets.
    std::string this_build, other_build;
    std::vector<std::string> simd = {best_simd_target().name};
    std::string line;

    bool wants(const std::string& work) const;
};

/// What the command line of a program can say.
enum class BenchProgram { kRun, kBuilds };

/// Parses the options, and returns what `run` returns; 0 after --help, and 2 after an error.
int bench_main(BenchProgram program, int argc, const char* const* argv,
               int (*run)(const BenchOptions& options));

}  // namespace mray::lab
