// The keyframes of a clip that are in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "common/interop/params.h"

namespace mray {

/// The positions of a keyframe, in world space. They stay in memory while a pointer to them exists.
using KeyframePositions = std::shared_ptr<const std::vector<vec3>>;

/// Keeps all keyframes of a clip of up to kResidentBytes, otherwise the two that were used last: as
/// many as a frame between keyframes needs. Threads may share one.
class KeyframeCache {
public:
    static constexpr std::size_t kResidentBytes = std::size_t{128} << 20;

    KeyframeCache(std::size_t keyframe_count, std::size_t vertex_count);

    /// The positions of a keyframe; null if they are not here.
    KeyframePositions find(std::size_t keyframe) const;
    void add(std::size_t keyframe, KeyframePositions positions);
    /// Whether nothing that is added leaves again.
    bool keeps_all() const { return keeps_all_; }

private:
    struct Entry {
        KeyframePositions positions;
        std::uint64_t last_use = 0;
    };

    bool keeps_all_;
    mutable std::mutex mutex_;
    mutable std::uint64_t uses_ = 0;
    mutable std::map<std::size_t, Entry> entries_;
};

}  // namespace mray
