// The steps that the shrinker tries: each makes a case a little simpler.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/fuzz/case/fuzz_case.h"

namespace morphray::fuzz {

/// The frame alone; the pose of the build and the frame; in this order, where that is fewer.
std::vector<FuzzCase> with_fewer_poses(const FuzzCase& fuzz_case);

/// Vertices that no triangle uses. They count for the bounds of the scene.
std::vector<std::uint32_t> idle_vertices(const FuzzCase& fuzz_case);
/// Without `count` of them from the one at `first`.
FuzzCase without_idle_vertices(const FuzzCase& fuzz_case, std::size_t first, std::size_t count);

/// With fewer secondary rays, or none.
std::vector<ViewSpec> with_simpler_rays(const ViewSpec& view);

/// Smaller images: parts of it around pixel (x, y) with about the same rays (a camera's image
/// is around its target, so the rays differ by rounding), and images of as many degrees. The
/// smallest come first.
std::vector<ViewSpec> with_fewer_pixels(const ViewSpec& view, std::uint32_t x, std::uint32_t y);

/// The numbers of a case: of the view, the poses and the rays.
std::size_t number_count(const FuzzCase& fuzz_case);
/// Rounds a number to so many binary digits, 0 makes it 0. False if it has no more than those.
bool round_number(FuzzCase& fuzz_case, std::size_t index, int bits);

}  // namespace morphray::fuzz
