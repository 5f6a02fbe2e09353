// A scene that keeps the arrays it borrows.
#pragma once

#include <functional>
#include <mutex>
#include <set>
#include <shared_mutex>

#include "library/python/module/arrays.h"
#include "library/python/module/module.h"

namespace morphray::python {

/// A mesh whose points a scene borrows; it copies all else.
struct BorrowedMesh {
    py::array points;
    Positions positions;
    std::vector<std::uint32_t> triangles;
    std::vector<std::uint32_t> albedo;
    MeshTextures textures;
    bool deforms = true;

    MeshView view() const {
        return {positions,
                triangles,
                deforms,
                {.albedo = albedo,
                 .smooth = triangles,
                 .textures = textures.views,
                 .texcoords = textures.texcoords,
                 .texture_ids = textures.ids}};
    }
};

/// `place` is put before the names of the arrays in messages.
BorrowedMesh borrow(const py::object& points, const py::object& triangles, bool deforms,
                    const py::object& albedo, const py::object& textures,
                    const std::string& place = {});

/// A scene has queries or one change at a time. Members give up the GIL while they work.
class PyScene {
public:
    /// Without an origin, that of the first mesh is found, in an empty scene by the first attach().
    PyScene(const std::vector<BorrowedMesh>& meshes, const Device& device,
            const SceneOptions& options, const std::optional<Point>& origin);
    ~PyScene();
    PyScene(const PyScene&) = delete;

    Update update(bool takes_bounds);
    Update update(std::uint32_t geom_id, std::size_t first, std::optional<std::size_t> count);
    Update update(std::uint32_t geom_id, const py::object& points);
    Update update(const std::vector<MeshPose>& poses);
    std::uint32_t attach(const BorrowedMesh& mesh);
    void detach(std::uint32_t geom_id);

    /// `cancel`, which may be null, ends the query, and so does SIGINT if it may take long.
    void query(std::size_t count, Cancel* cancel,
               const std::function<void(const Scene&, const std::atomic<bool>*)>& work);
    /// Returns work(scene), which is short.
    template <class Work>
    auto read(Work work) {
        const std::shared_lock lock = query_lock();
        const GilRelease release;
        return work(*scene_);
    }
    std::unique_ptr<PyScene> on(const Device& device);
    /// Warns once if inside by the rule is not that of a solid.
    void warn_if_open(FillRule rule);

    /// Held by queries. Throws Error(busy) during a change.
    std::shared_lock<std::shared_mutex> query_lock();
    const Scene& scene() const { return *scene_; }
    /// A copy: attach() may replace an empty scene.
    Device device() const { return scene_->device(); }
    const Point& origin() const { return scene_->origin(); }

private:
    PyScene() = default;
    std::unique_lock<std::shared_mutex> change_lock();
    /// Runs `change`, which SIGINT ends, then `take_points` with the GIL, and warns.
    Update run_change(const std::function<Update()>& change,
                      const std::function<void()>& take_points = {});
    /// Warns once of points that rounding moves by more than 1e-6 of the size of their mesh, and
    /// once a mesh of points that are left out.
    void warn_of_points(const Update& update);

    /// The arrays of points by geom_id, and those that the scene reads until the next update().
    std::map<std::uint32_t, py::array> points_;
    std::vector<py::array> detached_points_;
    /// Ends the building of its trees.
    std::atomic<bool> cancel_build_ = false;
    std::optional<Scene> scene_;
    /// What an empty scene is made with once the first mesh tells its origin.
    std::optional<SceneOptions> empty_options_;
    bool has_warned_of_rounding_ = false;
    /// By rule. A mesh that is attached is checked, too.
    std::array<std::atomic<bool>, 2> has_checked_edges_ = {};
    std::set<std::uint32_t> warned_of_left_out_;
    std::shared_mutex mutex_;
};

}  // namespace morphray::python
