// The command line of the comparison of two builds.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/simd/simd_target.h"

namespace mray::bench {

struct CompareOptions {
    /// The shared objects.
    std::string this_build, other_build;
    std::vector<std::string> scenes = {"builtin:spikes:70000", "builtin:cloth:180000",
                                       "builtin:herd:1000000", "builtin:hall"};
    std::vector<std::string> works = {"primary", "shadow", "diffuse", "ao", "one-ray"};
    std::vector<std::string> simd = {best_simd_target().name};
    int repeat = 7;
    std::uint32_t flush_mib = 0;
    std::string csv;
    /// The text that --help asks for, else empty.
    std::string help;
};

/// Throws Error(kBadArgument). Names of works, scenes and instruction sets are left to the builds.
CompareOptions parse_compare_options(std::span<const std::string> arguments);

}  // namespace mray::bench
