// Makes cases from seeds.
#pragma once

#include <cstdint>

#include "tests/fuzz/case/fuzz_case.h"

namespace mray::fuzz {

struct GeneratorConfig {
    /// Ray-triangle tests that brute force may take for an image.
    double tests = 4e5;
    std::size_t rays = 48;
};

/// A pure function of seed and config. make_image_params() may refuse the view.
FuzzCase make_case(std::uint64_t seed, const GeneratorConfig& config = {});

/// The number of rays, and of points, of make_questions(); in one of four cases the rays, or the
/// points, come in groups, so many that they are asked about together.
inline constexpr std::size_t kAskedRays = 24;
inline constexpr std::size_t kAskedRayGroups = 2;
inline constexpr std::size_t kRayGroupSize = 40;
inline constexpr std::size_t kAskedPoints = 64;
inline constexpr std::size_t kAskedGroups = 20;
inline constexpr std::size_t kGroupSize = 16;

/// A case of questions alone: a pure function of seed.
FuzzCase make_questions(std::uint64_t seed);

/// The seed of a campaign's case.
std::uint64_t case_seed(std::uint64_t campaign_seed, std::uint64_t index);

}  // namespace mray::fuzz
