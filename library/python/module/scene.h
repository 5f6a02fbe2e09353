// A scene that keeps the arrays it borrows.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <span>
#include <string>
#include <vector>

#include "library/python/module/arrays.h"
#include "library/python/module/interruptible.h"
#include "morphray/error.hpp"
#include "morphray/scene.hpp"

namespace morphray::python {

/// A mesh that a scene borrows.
struct BorrowedMesh {
    py::array points;
    Positions positions;
    std::shared_ptr<const std::vector<std::uint32_t>> triangles;
    std::vector<std::uint32_t> albedo;
    MeshTextures textures;
    bool deforms = true;

    MeshView view() const {
        MeshView mesh{positions, *triangles, deforms, albedo, *triangles};
        mesh.textures = textures.views;
        mesh.texcoords = textures.texcoords;
        mesh.texture_ids = textures.ids;
        return mesh;
    }
    /// Once the scene has copied them.
    void forget_colours() {
        albedo = {};
        textures = {};
    }
};

/// `place` is put before the names of the arrays in messages.
BorrowedMesh borrow(const py::object& points, const py::object& triangles, bool deforms,
                    const py::object& albedo, const py::object& textures,
                    const std::string& place = {});

/// The size of batches for rays that are converted: whole rows of an image, in eights, as tiles
/// have them.
std::size_t converted_size(Coherence coherence);
/// All rays where nothing has to be converted, and otherwise converted_size().
std::size_t batch_size(const QueryArray& rays, Coherence coherence);
/// Calls `work(first, rays)` for batches of rays as those of C++; without rays, once: it may have
/// an error to throw. Rays of six numbers have these limits.
void for_each_batch(const QueryArray& rays, std::size_t batch_size, float tnear, float tfar,
                    const std::function<void(std::size_t, std::span<const Ray>)>& work);

/// Any number of queries or one change at a time use a scene. C++ leaves a query during an update
/// undefined; here it is an error. Members are called with the GIL, and give it up while they work.
class PyScene {
public:
    using Meshes = std::map<std::uint32_t, BorrowedMesh>;

    PyScene(std::vector<BorrowedMesh> meshes, const Device& device, const SceneOptions& options);
    ~PyScene();
    PyScene(const PyScene&) = delete;

    Update update(bool takes_bounds);
    Update update(std::uint32_t geom_id, std::size_t first, std::optional<std::size_t> count);
    std::uint32_t attach(BorrowedMesh mesh);
    void detach(std::uint32_t geom_id);

    /// Calls `work(scene, cancelled)` as a query of so many rays or points, which `cancel`, which
    /// may be null, ends, and SIGINT if it may take long.
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

    /// Held by queries. Throws Error(busy) during a change.
    std::shared_lock<std::shared_mutex> query_lock();
    const Scene& scene() const { return *scene_; }
    const Device& device() const { return scene_->device(); }
    /// Those of the last update(), by geom_id.
    const Meshes& meshes() const { return meshes_; }

private:
    PyScene() = default;
    std::unique_lock<std::shared_mutex> change_lock();

    Meshes meshes_;
    /// Those that the next update() will have.
    Meshes next_meshes_;
    /// Ends the building of its trees.
    std::atomic<bool> cancel_build_ = false;
    std::optional<Scene> scene_;
    std::shared_mutex mutex_;
};

}  // namespace morphray::python
