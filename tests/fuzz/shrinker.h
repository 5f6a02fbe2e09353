// Shrinks a failing case, writes it to a file and prints it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "tests/fuzz/judge/judge.h"

namespace mray::fuzz {

/// Whether a case fails in the way that is looked for.
using Fails = std::function<bool(const FuzzCase&)>;

/// Returns a failing case that has lost what it can lose: its image, poses, triangles, unused
/// vertices, rays, points, rays of pixels, and pixels. Ends early after
/// `trials` calls of `fails`.
FuzzCase shrink(const FuzzCase& failing, const Fails& fails, std::size_t trials = 3000);

struct FailureName {
    /// The folder for a folder of each failure.
    std::filesystem::path out;
    /// The kind of the case and its seed.
    std::string name;
    /// cpu or vulkan.
    std::string backend;
};

/// Shrinks the failure for the variant of the finding, writes it as text and prints it with the
/// line that replays it. Throws Error(kOutput).
void report_failure(const FailureName& name, const FuzzCase& fuzz_case, const Finding& finding,
                    Referee& referee);

}  // namespace mray::fuzz
