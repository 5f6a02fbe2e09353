// The traced works of the benchmark as a shared object. Two builds of this project have the same
// C++ names, so a program that compares them loads each as an object that shows one function alone.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace mray::bench {

/// Changes with this file: objects with different numbers cannot be compared.
inline constexpr int kBuildInterface = 2;

/// A work and a tracer for it.
class BuiltWork {
public:
    virtual ~BuiltWork() = default;

    /// How many rays the work has, and in how many parts they are traced.
    virtual std::size_t rays() const = 0;
    virtual std::size_t parts() const = 0;
    /// Traces a part on one thread.
    virtual void trace_part(std::size_t part) = 0;
    /// The size of the answer of a ray: 16 bytes for a hit, 1 for what is occluded.
    virtual std::size_t answer_size() const = 0;
    /// The bytes of all answers, in an order that all tracers of a work have in common. Rays that
    /// the work does not have are 0.
    virtual std::vector<unsigned char> answers() const = 0;
};

struct BuildFunctions {
    int interface;
    /// The version of the build, with its commit.
    const char* version;
    /// Opens a scene in the view of ./lab/bench/run, of 1024 x 1024 pixels. work: primary, shadow,
    /// diffuse, ao or one-ray; tracer: packet, stream or single; simd: the name of an instruction
    /// set. Returns null if there is no such tracer for the work. Throws what open_scene() does.
    std::unique_ptr<BuiltWork> (*open)(const std::string& scene, const std::string& work,
                                       const std::string& tracer, const std::string& simd);
};

/// The one symbol of the object, a function that returns its BuildFunctions.
inline constexpr const char* kBuildSymbol = "morphray_build_functions";

}  // namespace mray::bench
