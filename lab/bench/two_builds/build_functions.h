// The traced works of the benchmark as a shared object. Two builds of this project have the same
// C++ names, so a program that compares them loads each as an object that shows one function alone.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace mray::lab {

/// Changes with this file: objects with different numbers cannot be compared.
inline constexpr int kBuildInterface = 3;

struct BuiltTracer {
    std::size_t rays = 0;
    std::size_t parts = 0;
    /// The size of the answer of a ray: 16 bytes for a hit, 1 for what is occluded.
    std::size_t answer_size = 0;
    /// Traces a part on one thread. Empty if there is no such tracer for the work.
    std::function<void(std::size_t part)> trace_part = {};
    /// All answers in an order that the tracers of a work have in common; 0 where it has no rays.
    std::function<std::vector<unsigned char>()> answers = {};
};

struct BuildFunctions {
    int interface;
    const char* version;
    /// Opens a scene in the view of ./lab/bench/run. work: primary, shadow, diffuse, ao or one-ray;
    /// tracer: packet, stream or single. Throws what open_scene() does.
    BuiltTracer (*open)(const std::string& scene, const std::string& work,
                        const std::string& tracer, const std::string& simd);
};

/// The one symbol of the object, a function that returns its BuildFunctions.
inline constexpr const char* kBuildSymbol = "morphray_build_functions";

}  // namespace mray::lab
