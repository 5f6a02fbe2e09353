// Steps of the shrinker, each of which makes a case a little simpler.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/fuzz/case/fuzz_case.h"

namespace mray::fuzz {

/// Cases with fewer poses: the frame alone, then the pose of the build and the frame.
std::vector<FuzzCase> with_fewer_poses(const FuzzCase& fuzz_case);

/// Vertices that no triangle uses. They count for the bounds of the scene.
std::vector<std::uint32_t> idle_vertices(const FuzzCase& fuzz_case);
/// The case without `count` idle vertices, starting with the one at `first`.
FuzzCase without_idle_vertices(const FuzzCase& fuzz_case, std::size_t first, std::size_t count);

/// Views with fewer secondary rays, or none.
std::vector<ViewSpec> with_simpler_rays(const ViewSpec& view);

/// Smaller images: parts of it around pixel (x, y) with about the same rays (a camera's image
/// is around its target, so the rays differ by rounding), and images of as many degrees. The
/// smallest come first.
std::vector<ViewSpec> with_fewer_pixels(const ViewSpec& view, std::uint32_t x, std::uint32_t y);

/// The numbers of a case: of the view, the poses, the rays and the points.
std::size_t number_count(const FuzzCase& fuzz_case);
/// Rounds a number to `bits` binary digits; 0 bits give 0. Returns whether that changes it.
bool round_number(FuzzCase& fuzz_case, std::size_t index, int bits);

}  // namespace mray::fuzz
