// Scenes: attached geometries, and what a commit makes of them.
#pragma once

#include <mutex>

#include "library/embree/committed_mesh.h"
#include "morphray/scene.hpp"

namespace mray::embree {

class BoxTree;

/// The scene as queries read it. Its meshes are the meshes of `scene`, by geom_id.
struct Committed {
    std::vector<CommittedMesh> meshes;
    /// A scene without triangles has none.
    std::optional<morphray::Scene> scene;
    /// Updates refit, whatever the tree is like then.
    bool is_refitted = false;
    bool is_robust = false;
    /// All different masks on the way to meshes; none, which no ray is compared with, unless the
    /// caller has set one.
    std::vector<unsigned int> masks;
    /// A mesh has a filter for hits, or for occlusion.
    bool filters_hits = false;
    bool filters_occlusion = false;

    void read_settings();
    /// A tree of all primitives, made by the first call at a pose. Threads may call it at once.
    const BoxTree& boxes() const;
    void forget_boxes() { made_boxes_ = nullptr; }

private:
    mutable std::mutex boxes_mutex_;
    mutable std::shared_ptr<const BoxTree> made_boxes_;
};

/// Many threads may ask and attach at a time. A commit during queries of the scene is undefined.
class SceneObject final : public Object {
public:
    explicit SceneObject(Device& device) : device_(share(device)) {}

    Device& device() const { return *device_; }

    /// The lowest ID that is free, or `id` if it is given. Throws Failure if that is taken.
    unsigned int attach(Geometry& geometry, unsigned int id = kInvalid);
    void detach(unsigned int id);
    /// Without a lock; null if there is none.
    Geometry* find(unsigned int id) const;
    /// As find(). Throws Failure if there is none.
    Geometry& at(unsigned int id) const;
    std::mutex& mutex() const { return mutex_; }
    /// A copy: other threads may attach to an instanced scene while one with it is committed.
    Attachments attachments() const {
        const std::scoped_lock lock(mutex_);
        return attachments_;
    }

    /// Brings queries to the geometries. Of several threads the first one works. Throws Failure or
    /// morphray::Error; then queries are refused until a later commit succeeds.
    void commit();
    /// Throws Failure if there was no commit, or the last one failed.
    const Committed& committed() const {
        if (committed_ == nullptr) fail_operation("the scene is not committed");
        return *committed_;
    }

    RTCSceneFlags flags = RTC_SCENE_FLAG_NONE;

private:
    void commit_meshes(std::vector<CommittedMesh> meshes);
    void build(std::vector<CommittedMesh> meshes);
    /// Returns false if the tree has other triangles than it must have at these positions.
    bool update(const std::vector<CommittedMesh>& meshes);

    Ref<Device> device_;
    mutable std::mutex mutex_;
    Attachments attachments_;
    /// All IDs below are taken.
    unsigned int lowest_free_ = 0;
    std::mutex commit_mutex_;
    std::unique_ptr<Committed> committed_;
};

}  // namespace mray::embree
