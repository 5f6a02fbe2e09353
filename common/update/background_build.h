// Builds a tree in the background while frames are traced.
#pragma once

#include <atomic>
#include <future>
#include <span>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"

namespace mray {

/// Based on: T. Ize, I. Wald, S. Parker. Asynchronous BVH construction for ray tracing dynamic
/// scenes on parallel multi-core architectures. EGPGV 2007.
class BackgroundBuild {
public:
    BackgroundBuild() = default;
    /// Cancels a pending build and waits for its end.
    ~BackgroundBuild();
    BackgroundBuild(const BackgroundBuild&) = delete;
    BackgroundBuild& operator=(const BackgroundBuild&) = delete;

    /// Starts a build at a copy of these positions. No build may be pending. The topology must
    /// outlive the build.
    void start(const Topology& topology, std::span<const vec3> positions, SplitMethod split);

    bool pending() const { return result_.valid(); }
    /// Whether take() returns without waiting.
    bool ready() const;
    /// The tree over the positions of start(), and the time of its build.
    struct Result {
        Bvh bvh;
        double build_ms = 0;
    };
    /// Ends the pending build. Throws what the builder throws.
    Result take() { return result_.get(); }

private:
    std::atomic<bool> cancel_ = false;
    std::future<Result> result_;
};

}  // namespace mray
