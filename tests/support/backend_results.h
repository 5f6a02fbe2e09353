// Hashes of a backend's tree and images, and the cost of its last trace.
#pragma once

#include <cstdint>

#include "common/backend.h"
#include "common/update/tree_updater.h"

namespace mray::test {

inline Bvh tree_of(Backend& backend) {
    Bvh tree;
    backend.read_tree(tree);
    return tree;
}

inline std::uint64_t tree_hash(Backend& backend) { return bvh_hash(tree_of(backend)); }

struct ImageHashes {
    std::uint64_t hits;
    std::uint64_t image;
    bool operator==(const ImageHashes&) const = default;
};

inline ImageHashes image_hashes(Backend& backend, const ImageParams& params) {
    Frame frame;
    backend.trace_image(params, frame);
    return {hits_hash(frame), image_hash(frame)};
}

/// The cost of a backend's last trace, as a tree updater takes it.
inline TraceCost last_trace(Backend& backend) {
    const BackendTimes& times = backend.finish();
    return {times.trace_ms, times.rays};
}

}  // namespace mray::test
