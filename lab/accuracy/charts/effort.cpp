#include "lab/accuracy/charts/charts.h"

namespace mray::accuracy {

const Effort& quick_effort() {
    static const Effort effort{.side = 256,
                               .aimed_rays = 50'000,
                               .rounds = 3,
                               .placed_rays = 6'000,
                               .offsets = {1e3, 1e5},
                               .scales = {1e-6, 1, 1e6},
                               .policy_frames = 25,
                               .cone_points = 64,
                               .triangle_counts = {1'000, 10'000, 100'000}};
    return effort;
}

const Effort& full_effort() {
    static const Effort effort{.side = 1024,
                               .aimed_rays = 500'000,
                               .rounds = 5,
                               .placed_rays = 50'000,
                               .offsets = {1e3, 1e4, 1e5, 1e6, 1e7},
                               .scales = {1e-6, 1e-4, 1e-2, 1, 1e2, 1e4, 1e6},
                               .policy_frames = 25,
                               .cone_points = 256,
                               .triangle_counts = {1'000, 10'000, 100'000, 1'000'000, 4'000'000}};
    return effort;
}

}  // namespace mray::accuracy
