// Scenes: attached geometries, and what a commit makes of them.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "library/embree/scene/committed.h"

namespace mray::embree {

/// Queries may be asked by many threads at the same time. A commit that changes a scene during its
/// queries is undefined. Geometries may be attached by several threads at the same time.
class SceneObject final : public Object {
public:
    explicit SceneObject(Device& device);

    Device& device() const { return *device_; }

    /// The lowest ID that is free, or `id` if it is given. Throws Failure if that is taken.
    unsigned int attach(Geometry& geometry, unsigned int id = kInvalid);
    void detach(unsigned int id);
    /// Without a lock; null if there is none.
    Geometry* find(unsigned int id) const;
    Geometry* find_locked(unsigned int id) const;
    /// A copy: other threads may attach to an instanced scene while one with it is committed.
    Attachments attachments() const {
        const std::scoped_lock lock(mutex_);
        return attachments_;
    }

    void set_flags(RTCSceneFlags flags);
    RTCSceneFlags flags() const { return flags_; }
    void set_build_quality(RTCBuildQuality quality);

    /// Brings queries to the geometries. Several threads may call it: the first one works, the
    /// others wait. Throws Failure or morphray::Error; then queries are refused until a later
    /// commit succeeds.
    void commit();
    /// Throws Failure if there was no commit, or the last one failed.
    const Committed& committed() const {
        if (committed_ == nullptr) fail_operation("the scene is not committed");
        return *committed_;
    }

private:
    void commit_parts(std::vector<Part> parts);
    void build(std::vector<Part> parts);
    /// Returns false if the tree has other triangles than it must have at these positions.
    bool update(const std::vector<Part>& parts);

    Ref<Device> device_;
    mutable std::mutex mutex_;
    Attachments attachments_;
    /// All IDs below are taken.
    unsigned int lowest_free_ = 0;
    RTCSceneFlags flags_ = RTC_SCENE_FLAG_NONE;
    RTCBuildQuality quality_ = RTC_BUILD_QUALITY_MEDIUM;

    std::mutex commit_mutex_;
    std::unique_ptr<Committed> committed_;
};

}  // namespace mray::embree
