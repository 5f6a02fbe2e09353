#include "tests/fuzz/generate/generator.h"

#include "tests/fuzz/generate/motions.h"
#include "tests/fuzz/generate/points.h"
#include "tests/fuzz/generate/views.h"

namespace mray::fuzz {

FuzzCase make_case(std::uint64_t seed, const GeneratorConfig& config) {
    Dice dice(seed);
    FuzzCase fuzz_case;
    make_clip(dice, fuzz_case);
    const std::vector<vec3> positions = world_positions(fuzz_case, fuzz_case.frame);
    const Surroundings around(positions, fuzz_case.triangles);
    fuzz_case.view = make_view(dice, around, config.tests);
    fuzz_case.rays = make_rays(dice, around, config.rays);
    return fuzz_case;
}

FuzzCase make_questions(std::uint64_t seed) {
    Dice dice(seed);
    FuzzCase fuzz_case;
    make_clip(dice, fuzz_case);
    const std::vector<vec3> positions = world_positions(fuzz_case, fuzz_case.frame);
    const Surroundings around(positions, fuzz_case.triangles);
    fuzz_case.view.width = fuzz_case.view.height = 0;
    fuzz_case.rays = dice.one_in(4) ? make_ray_groups(dice, around, kAskedRayGroups, kRayGroupSize)
                                    : make_rays(dice, around, kAskedRays);
    fuzz_case.asks_questions = true;
    fuzz_case.points = dice.one_in(4) ? make_groups(dice, around, kAskedGroups, kGroupSize)
                                      : make_points(dice, around, kAskedPoints);
    return fuzz_case;
}

std::uint64_t case_seed(std::uint64_t campaign_seed, std::uint64_t index) {
    test::Random random(campaign_seed + index * 0xD1342543DE82EF95u);
    return random.bits();
}

}  // namespace mray::fuzz
