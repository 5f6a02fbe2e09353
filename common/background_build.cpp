#include "common/background_build.h"

#include <cassert>
#include <chrono>

#include "common/stopwatch.h"

namespace morphray {

void BackgroundBuild::start(const Topology& topology, std::span<const vec3> positions,
                            SplitMethod split) {
    assert(!pending());
    result_ = std::async(
        std::launch::async,
        [&topology, split, pose = std::vector<vec3>(positions.begin(), positions.end())] {
            const Stopwatch watch;
            Result result;
            result.bvh = build_bvh(topology, pose, {.split = split, .threads = 1});
            result.build_ms = watch.ms();
            return result;
        });
}

bool BackgroundBuild::ready() const {
    return pending() && result_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace morphray
