// Scenes: attached geometries, and what a commit makes of them.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "embree/scene/committed.h"

namespace mray::embree {

/// Queries may be asked by many threads at the same time, but not during a commit: those that begin
/// during one are refused, and a commit is if one stays under way. Geometries may be attached by
/// several threads at the same time.
class SceneObject final : public Object {
public:
    explicit SceneObject(Device& device);
    ~SceneObject() override;

    Device& device() const { return *device_; }
    /// That of the fallback library; null: none.
    RTCScene twin() const { return twin_; }
    /// The twin, if it answers the queries.
    RTCScene twin_in_use() const {
        return current() == nullptr && is_twin_committed_.load(std::memory_order_acquire) ? twin_
                                                                                          : nullptr;
    }
    /// The twin, if it may be asked at all: rays of user geometries go from twin to twin.
    RTCScene committed_twin() const {
        return is_twin_committed_.load(std::memory_order_acquire) ? twin_ : nullptr;
    }

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
    void set_progress_function(RTCProgressMonitorFunction function, void* user);

    /// Brings queries to the geometries. Several threads may call it: the first one works, the
    /// others wait. Throws Failure or morphray::Error; then queries are refused until a later
    /// commit succeeds. A scene with what is not supported is committed as its twin, if it has one.
    void commit();
    /// Null before the first commit, during one, and if the twin is in use.
    const Committed* current() const { return current_.load(std::memory_order_acquire); }
    /// To be called by each point query: from the first one on, commits make ready for others.
    void note_point_query() {
        if (!has_point_queries_.load(std::memory_order_relaxed))
            has_point_queries_.store(true, std::memory_order_relaxed);
    }

private:
    void commit_parts(std::vector<Part> parts);
    void commit_twin();
    /// Commits the twins of instanced scenes, then that of this one.
    void commit_twins(std::size_t level);
    /// Takes committed_ from queries. Throws Failure, and leaves it, if one stays under way.
    void take_from_queries();
    void forget();
    /// As forget(), but leaves the tree to a later scene if it may have it.
    void give_away();
    void build(std::vector<Part> parts);
    /// Returns false if the tree has other triangles than it must have at these positions.
    bool update(const std::vector<Part>& parts);
    void report_progress(double part) const;

    Ref<Device> device_;
    mutable std::mutex mutex_;
    Attachments attachments_;
    /// The geometries by ID, for find(); null for some that are attached.
    std::vector<Geometry*> by_id_;
    /// All IDs below are taken.
    unsigned int lowest_free_ = 0;
    RTCSceneFlags flags_ = RTC_SCENE_FLAG_NONE;
    RTCBuildQuality quality_ = RTC_BUILD_QUALITY_MEDIUM;
    RTCProgressMonitorFunction progress_function_ = nullptr;
    void* progress_user_ = nullptr;

    std::mutex commit_mutex_;
    std::unique_ptr<Committed> committed_;
    std::atomic<const Committed*> current_ = nullptr;
    std::atomic<bool> has_point_queries_ = false;

    RTCScene twin_ = nullptr;
    std::atomic<bool> is_twin_committed_ = false;
};

/// The fallback library and the twin that answers a scene there; false: the scene is ours.
struct Forward {
    const Fallback* library = nullptr;
    RTCScene scene = nullptr;

    explicit operator bool() const { return scene != nullptr; }
    const Fallback* operator->() const { return library; }
};
inline Forward forward(RTCScene handle) {
    const auto* const scene = reinterpret_cast<const SceneObject*>(handle);
    if (scene == nullptr || scene->twin_in_use() == nullptr) return {};
    return {scene->device().fallback(), scene->twin_in_use()};
}

}  // namespace mray::embree
