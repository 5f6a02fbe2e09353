// The command line of the benchmark.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/scene/camera_setup.h"

namespace mray::bench {

struct BenchOptions {
    std::vector<std::string> scenes;
    std::vector<std::string> works = {"primary", "shadow", "diffuse", "ao",
                                      "one-ray", "refit",  "build"};
    std::vector<int> threads = {1, 2};
    int repeat = 5;
    /// A square.
    ViewSpec view;
    std::string csv;
    /// The text that --help asks for, else empty.
    std::string help;

    bool wants(const std::string& work) const;
};

/// Throws Error(kBadArgument).
BenchOptions parse_options(std::span<const std::string> arguments);

}  // namespace mray::bench
