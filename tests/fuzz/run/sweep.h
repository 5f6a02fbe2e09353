// Traces a scene from eyes in the planes of all its triangles.
#pragma once

#include "tests/fuzz/case/fuzz_case.h"
#include "tests/fuzz/run/options.h"
#include "tests/fuzz/run/process.h"

namespace mray::fuzz {

/// The scene's frame as a case with one pose, without an image. Throws what open_scene throws.
FuzzCase open_sweep(const FuzzOptions& options);

/// Runs a process's part, with an eye in the plane of each options.every-th triangle, or 2^-8 to
/// 2^-50 extents off it. The reference is brute force if that takes at most 4e6 tests, otherwise
/// the scalar tracer. Returns an exit code.
int run_sweep(const FuzzOptions& options, const FuzzCase& scene_case, const Process& process);

}  // namespace mray::fuzz
