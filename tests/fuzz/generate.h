// Makes cases from seeds: shapes on which tracers fail, their motions, and points, rays, cameras
// and lights at which they fail.
#pragma once

#include <cstdint>

#include "tests/fuzz/case.h"

namespace mray::fuzz {

/// A pure function of the seed. make_image_params() may refuse the view.
FuzzCase make_case(std::uint64_t seed);

/// A case of questions alone: a pure function of the seed. In one of four cases the rays, or the
/// points, come in groups, so many that they are asked about together.
FuzzCase make_questions(std::uint64_t seed);

/// The seed of a campaign's case.
std::uint64_t case_seed(std::uint64_t campaign_seed, std::uint64_t index);

}  // namespace mray::fuzz
