#include "common/update/background_build.h"

#include <sys/resource.h>
#include <unistd.h>

#include <cassert>
#include <chrono>

#include "common/base/stopwatch.h"

namespace mray {
namespace {

/// Lowers this thread's priority: at normal priority a build slows down the threads that trace,
/// which have a core each. At a niceness of 10 a build starves while other programs run.
void give_way() {
    constexpr int kNiceness = 5;
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNiceness);
}

}  // namespace

BackgroundBuild::~BackgroundBuild() {
    cancel_ = true;
    if (pending()) result_.wait();
}

void BackgroundBuild::start(const Topology& topology, std::span<const vec3> positions,
                            SplitMethod split) {
    assert(!pending());
    result_ = std::async(
        std::launch::async,
        [this, &topology, split, pose = std::vector<vec3>(positions.begin(), positions.end())] {
            give_way();
            const Stopwatch watch;
            Result result;
            result.bvh =
                build_bvh(topology, pose, {.split = split, .threads = 1, .watch = Watch(&cancel_)});
            result.build_ms = watch.ms();
            return result;
        });
}

bool BackgroundBuild::ready() const {
    return pending() && result_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace mray
