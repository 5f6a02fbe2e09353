// The traced works of the benchmark as C functions of a shared object. Two builds of this project
// have the same C++ names, so a program that compares them loads each as an object that shows these
// functions alone.
#pragma once

#include <cstddef>

namespace mray::bench {

/// Changes with this file: objects with different numbers cannot be compared.
inline constexpr int kBuildInterface = 1;

/// A work, a tracer for it, and where that tracer writes its answers.
struct BuiltWork;

struct BuildFunctions {
    int interface;
    /// The version of the build, with its commit.
    const char* version;

    /// Opens a scene of open_scene() in the view of ./lab/bench/run, of 1024 x 1024 pixels. work:
    /// primary, shadow, diffuse, ao or one-ray; tracer: packet, stream or single; simd: the name of
    /// an instruction set. Returns null without an error if there is no such tracer for the work.
    /// For an error returns null, too, with the message in `error`, which is cut off at `size`
    /// bytes.
    BuiltWork* (*open)(const char* scene, const char* work, const char* tracer, const char* simd,
                       char* error, std::size_t size);
    void (*close)(BuiltWork*);

    /// How many rays the work has, and in how many parts they are traced.
    std::size_t (*rays)(const BuiltWork*);
    std::size_t (*parts)(const BuiltWork*);
    /// Traces a part on one thread.
    void (*trace_part)(BuiltWork*, std::size_t part);

    /// The answers, in an order that all tracers of a work have in common: hits of 16 bytes, or a
    /// byte for each ray. Rays that the work does not have are 0. Valid until the next call.
    const unsigned char* (*answers)(BuiltWork*, std::size_t* answer_size, std::size_t* count);
};

/// The one symbol of the object, a function that returns its BuildFunctions.
inline constexpr const char* kBuildSymbol = "morphray_build_functions";

}  // namespace mray::bench
