// A scene that keeps the arrays it borrows.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "library/python/module/arrays.h"
#include "library/python/module/gil_release.h"
#include "library/python/module/interruptible.h"
#include "library/python/module/textures.h"
#include "library/python/module/use_guard.h"
#include "morphray/compare.hpp"
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

/// The arrays that cast_rays() fills, one element a ray.
struct CastHits {
    float* t_hit;
    std::uint32_t* geometry_ids;
    std::uint32_t* primitive_ids;
    float* primitive_uvs;
    float* primitive_normals;
};

/// All rays where nothing has to be converted, and otherwise as many as are converted together.
std::size_t batch_size(const QueryArray& rays, Coherence coherence);
/// Calls `work(first, rays)` for batches of rays as those of C++; without rays, once: it may have
/// an error to throw. Rays of six numbers have these limits.
void for_each_batch(const QueryArray& rays, std::size_t batch_size, float tnear, float tfar,
                    const std::function<void(std::size_t, std::span<const Ray>)>& work);

/// Members are called with the GIL, and give it up while they work.
class PyScene {
public:
    PyScene(std::vector<BorrowedMesh> meshes, const Device& device, const SceneOptions& options);
    ~PyScene();
    PyScene(const PyScene&) = delete;

    Update update(bool takes_bounds);
    Update update(std::uint32_t geom_id, std::size_t first, std::optional<std::size_t> count);
    std::uint32_t attach(BorrowedMesh mesh);
    void detach(std::uint32_t geom_id);

    void intersect(const QueryArray& rays, Coherence coherence, std::span<Hit> hits);
    void occluded(const QueryArray& rays, Coherence coherence, float tnear, float tfar,
                  std::span<std::uint8_t> occluded);
    void cast(const QueryArray& rays, Coherence coherence, const CastHits& out);

    /// Calls `work(scene, cancelled)` for questions that any triangle may have a part in the answer
    /// of: long ones end early when `cancel`, which may be null, is set.
    void ask(const QueryArray& queries, Cancel* cancel,
             const std::function<void(const Scene&, const std::atomic<bool>*)>& work);

    Comparison compare(PyScene& other, const QueryArray& rays, std::size_t keep);
    std::unique_ptr<PyScene> on(const Device& device);

    Image render(View view, Cancel* cancel);

    /// Calls `work(scene)` as a query.
    template <class Work>
    auto query(Work work) {
        const QueryUse use(uses_);
        const GilRelease release;
        return work(*scene_);
    }

    const Device& device() const { return scene_->device(); }

private:
    using Meshes = std::map<std::uint32_t, BorrowedMesh>;

    PyScene() = default;
    bool is_long(std::size_t rays) const;
    void build_interruptibly(std::size_t triangles, const std::function<void()>& work);

    /// Those of the last update(), and those that the next one will have.
    Meshes meshes_;
    Meshes next_meshes_;
    /// Ends the building of its trees.
    std::atomic<bool> cancel_build_ = false;
    std::optional<Scene> scene_;
    UseCount uses_;
};

}  // namespace morphray::python
