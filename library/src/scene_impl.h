// The state of a Scene: meshes, their positions, and a backend with a tree that follows them.
#pragma once

#include "common/scene/vertex_normals.h"
#include "common/update/tree_updater.h"
#include "library/src/device_impl.h"
#include "library/src/query_cost.h"
#include "library/src/ray_order.h"
#include "library/src/ray_space.h"
#include "library/src/render.h"
#include "library/src/scene/errors.h"
#include "library/src/scene/pose_reader.h"

namespace morphray::detail {

class SceneImpl {
public:
    /// Reads the meshes and builds a tree. Throws Error(bad_argument) for unsuitable options.
    SceneImpl(std::span<const MeshView> meshes, const Device& device, const SceneOptions& options);
    /// The meshes of `other` at its pose, with a copy of its tree.
    SceneImpl(const SceneImpl& other, const Device& device, const std::atomic<bool>* cancel);

    static SceneImpl& of(const Scene& scene) { return *scene.impl_; }

    /// Keeps other changes out. Throws Error(busy), and as require_usable().
    std::unique_lock<std::mutex> change_lock();
    /// Reads positions, but leaves the tree as it is (engine.h).
    void read_positions(std::span<const MeshVertices> vertices);

    /// Throws what broke the scene, or mray::Error in a forked child of a device's process.
    void require_usable() const {
        tracer_->require_own_process();
        if (broken_) throw *broken_;
    }

    const Device& device() const { return device_; }
    const SceneOptions& options() const { return options_; }
    const MeshList& meshes() const { return meshes_; }
    const PoseReader& pose() const { return pose_; }
    const RaySpace& space() const { return *space_; }
    const mray::SimdTarget& target() const { return DeviceImpl::of(device_).simd_target; }
    mray::ThreadArena& arena() const { return DeviceImpl::of(device_).arena; }
    QueryCost cost;
    SharedRaySorter sorter;
    ImageMemory image_memory;

    /// Images lock it, and queries for the members below.
    std::mutex& mutex() const { return mutex_; }
    mray::Backend& tracer() const { return *tracer_; }
    const mray::VertexNormals& normals();
    /// The only mesh of each subtree of the host's tree, numbered as in mray::TriangleFilter, or
    /// kNoGeometry. Valid until the next update. The mutex must be free.
    std::span<const std::uint32_t> meshes_of_subtrees();

private:
    /// Its changes hold the change_lock().
    friend class morphray::Scene;

    Update to_public(const mray::TreeUpdate& update) const;
    const MeshSlot& mesh_to_update(std::uint32_t geom_id) const;
    template <class Work>
    Update run_update(Work work);
    Update update_all(bool takes_bounds);
    Update update_vertices(std::uint32_t geom_id, std::size_t first, std::size_t count);
    template <class Read>
    void read_pose(Read read);
    void start(const mray::Bvh* tree);
    void change_meshes();
    void follow(std::span<const MeshVertices> vertices);

    Device device_;
    SceneOptions options_;
    MeshList meshes_;
    PoseReader pose_;
    std::optional<RaySpace> space_;
    std::unique_ptr<mray::Backend> tracer_;
    std::unique_ptr<mray::TreeUpdater> updater_;
    double read_ms_ = 0;
    std::vector<LeftOut> left_out_;
    std::mutex change_mutex_;
    /// Why the scene is of no use any more.
    std::optional<Error> broken_;
    mutable std::mutex mutex_;
    std::optional<mray::VertexNormals> normals_;
    bool has_normals_of_pose_ = false;
    std::vector<std::uint32_t> meshes_of_subtrees_;
    /// False until they are found for the current tree. Threads read it without the mutex.
    std::atomic<bool> knows_meshes_of_subtrees_ = false;
    /// At the pose of the first question.
    std::optional<EdgeCounts> edge_counts_;
};

/// The unit normal of a triangle; 0 without an area, or with a corner that is not finite.
mray::vec3 flat_normal(const SceneImpl& scene, std::uint32_t prim);
/// The normals of its corners: `flat` for those that are not smooth.
std::array<mray::vec3, 3> corner_normals(const mray::VertexNormals& smooth, std::uint32_t prim,
                                         mray::vec3 flat);

/// Throws Error for a scene that has been moved from.
inline SceneImpl& require(const std::unique_ptr<SceneImpl>& impl) {
    if (impl == nullptr) throw_bad_argument("this scene has been moved from");
    return *impl;
}

/// Throws Error unless there is one answer for each question.
inline void require_room(std::size_t questions, const char* what, std::size_t answers) {
    if (questions == answers) return;
    throw_bad_argument("{} {}, but room for {} answers", questions, what, answers);
}

/// Calls work(scene) for a scene that can be used; whatever it throws comes out as a public Error.
template <class Work>
decltype(auto) with_scene(const std::unique_ptr<SceneImpl>& impl, Work work) {
    return with_public_errors([&]() -> decltype(auto) {
        SceneImpl& scene = require(impl);
        scene.require_usable();
        return work(scene);
    });
}

}  // namespace morphray::detail
