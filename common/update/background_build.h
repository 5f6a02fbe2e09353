// A tree that is built on a spare thread while frames go on.
#pragma once

#include <future>
#include <span>
#include <vector>

#include "common/bvh/bvh_builder.h"

namespace morphray {

/// Based on: T. Ize, I. Wald, S. Parker. Asynchronous BVH construction for ray tracing dynamic
/// scenes on parallel multi-core architectures. EGPGV 2007.
class BackgroundBuild {
public:
    BackgroundBuild() = default;

    /// Starts at a copy of these positions; nothing may be pending. The topology must stay until
    /// the result is taken or this is destroyed, which waits.
    void start(const Topology& topology, std::span<const vec3> positions, SplitMethod split);

    bool pending() const { return result_.valid(); }
    /// Whether take() would not wait.
    bool ready() const;
    /// The tree, over the positions of start(), and the milliseconds that it took. Throws what the
    /// builder throws.
    struct Result {
        Bvh bvh;
        double build_ms = 0;
    };
    Result take() { return result_.get(); }

private:
    std::future<Result> result_;
};

}  // namespace morphray
