#include "scenes/keyframes/keyframe_cache.h"

#include <algorithm>
#include <utility>

namespace mray {
namespace {

constexpr std::size_t kFew = 2;

}  // namespace

KeyframeCache::KeyframeCache(std::size_t keyframe_count, std::size_t vertex_count)
    : keeps_all_(vertex_count == 0 ||
                 keyframe_count <= kResidentBytes / (vertex_count * sizeof(vec3))) {}

KeyframePositions KeyframeCache::find(std::size_t keyframe) const {
    const std::scoped_lock lock(mutex_);
    const auto found = entries_.find(keyframe);
    if (found == entries_.end()) return nullptr;
    found->second.last_use = ++uses_;
    return found->second.positions;
}

void KeyframeCache::add(std::size_t keyframe, KeyframePositions positions) {
    const std::scoped_lock lock(mutex_);
    entries_.insert_or_assign(keyframe, Entry{std::move(positions), ++uses_});
    if (keeps_all_ || entries_.size() <= kFew) return;
    entries_.erase(std::min_element(entries_.begin(), entries_.end(), [](auto& a, auto& b) {
        return a.second.last_use < b.second.last_use;
    }));
}

}  // namespace mray
