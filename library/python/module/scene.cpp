#include "library/python/module/scene.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "library/python/module/gil_release.h"

namespace morphray::python {
namespace {

// Rays that are converted and traced together.
constexpr std::size_t kBatch = std::size_t{1} << 18;
// Queries below both limits take some milliseconds at most: they run in the calling thread and
// cannot be interrupted. Larger ones take a hundred times as long as handing them to another thread
// and back (20 us).
constexpr std::size_t kManyRays = std::size_t{1} << 14;
// Triangles from which building a tree over them may take more than some milliseconds.
constexpr std::size_t kManyTriangles = std::size_t{1} << 16;
constexpr std::size_t kManyTests = std::size_t{1} << 24;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Calls `work(cancel)`, without the GIL. Handlers of signals can end what is long, and `owner` can
/// end anything if it is not null.
template <class Work>
void trace(bool is_long, Cancel* owner, Work work) {
    std::atomic<bool> cancel = false;
    const Cancel::Use use(owner, cancel);
    if (is_long) {
        run_interruptibly(cancel, [&] { work(&cancel); });
        return;
    }
    const GilRelease release;
    work(&cancel);
}

/// The corners of a mesh's triangles, which normals are made of.
struct Corners {
    Positions positions;
    std::span<const std::uint32_t> triangles;

    Vec3 point(std::uint32_t vertex) const {
        Vec3 p;
        std::memcpy(&p, static_cast<const std::byte*>(positions.data) + vertex * positions.stride,
                    sizeof(p));
        return p;
    }
};

/// Writes a normal of length 1, or of length 0 for a triangle without area. Computes in doubles,
/// where products of floats do not overflow.
void write_normal(const Corners& mesh, std::uint32_t prim_id, float* out) {
    const std::uint32_t* const corner = &mesh.triangles[std::size_t{3} * prim_id];
    const Vec3 p0 = mesh.point(corner[0]);
    const Vec3 p1 = mesh.point(corner[1]);
    const Vec3 p2 = mesh.point(corner[2]);
    const double a[] = {double{p1.x} - p0.x, double{p1.y} - p0.y, double{p1.z} - p0.z};
    const double b[] = {double{p2.x} - p0.x, double{p2.y} - p0.y, double{p2.z} - p0.z};
    const double n[] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                        a[0] * b[1] - a[1] * b[0]};
    const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    // Positions may have become NaN or infinite since the last update.
    const bool has_area = length > 0 && std::isfinite(length);
    for (int axis = 0; axis < 3; ++axis)
        out[axis] = has_area ? static_cast<float>(n[axis] / length) : 0.0f;
}

void write_cast(std::span<const Hit> hits, std::size_t first, std::span<const Corners> meshes,
                const CastHits& out) {
    for (std::size_t i = 0; i < hits.size(); ++i) {
        const Hit& hit = hits[i];
        const std::size_t at = first + i;
        out.t_hit[at] = hit ? hit.t : kInfinity;
        out.geometry_ids[at] = hit.geom_id;
        out.primitive_ids[at] = hit.prim_id;
        out.primitive_uvs[2 * at] = hit.u;
        out.primitive_uvs[2 * at + 1] = hit.v;
        float* const normal = out.primitive_normals + 3 * at;
        if (hit) {
            write_normal(meshes[hit.geom_id], hit.prim_id, normal);
        } else {
            std::fill_n(normal, 3, 0.0f);
        }
    }
}

/// The rays that are converted together: whole rows of an image, in eights, as tiles have them.
std::size_t converted_size(Coherence coherence) {
    const std::size_t rows = 8 * std::max<std::size_t>(coherence.width, 1);
    return std::max(kBatch / rows, std::size_t{1}) * rows;
}

}  // namespace

std::size_t batch_size(const QueryArray& rays, Coherence coherence) {
    return rays.columns == 8 ? std::max<std::size_t>(rays.count, 1) : converted_size(coherence);
}

void for_each_batch(const QueryArray& rays, std::size_t batch_size, float tnear, float tfar,
                    const std::function<void(std::size_t, std::span<const Ray>)>& work) {
    std::vector<Ray> converted;
    std::size_t first = 0;
    do {
        const std::size_t count = std::min(batch_size, rays.count - first);
        const float* from = rays.data + first * rays.columns;
        if (rays.columns == 8) {
            // Ray is laid out as eight floats.
            work(first, std::span(reinterpret_cast<const Ray*>(from), count));
        } else {
            converted.resize(count);
            for (Ray& ray : converted) {
                ray = {{from[0], from[1], from[2]}, tnear, {from[3], from[4], from[5]}, tfar};
                from += 6;
            }
            work(first, std::span<const Ray>(converted));
        }
        first += count;
    } while (first < rays.count);
}

BorrowedMesh borrow(const py::object& points, const py::object& triangles, bool deforms,
                    const py::object& albedo, const py::object& textures,
                    const std::string& place) {
    const py::array array = points_array(points, place + "points");
    BorrowedMesh mesh;
    mesh.positions = positions_of(array, place + "points");
    mesh.points = array;
    mesh.triangles = std::make_shared<const std::vector<std::uint32_t>>(
        indices_of(triangles, place + "triangles"));
    mesh.albedo = albedo_of(albedo, place + "albedo");
    mesh.textures = textures_of(textures, place + "textures");
    mesh.deforms = deforms;
    return mesh;
}

PyScene::PyScene(std::vector<BorrowedMesh> meshes, const Device& device,
                 const SceneOptions& options) {
    std::vector<MeshView> views;
    for (const BorrowedMesh& mesh : meshes) views.push_back(mesh.view());
    std::size_t triangles = 0;
    for (const BorrowedMesh& mesh : meshes) triangles += mesh.triangles->size() / 3;
    SceneOptions cancellable = options;
    cancellable.cancel = &cancel_build_;
    build_interruptibly(triangles, [&] {
        scene_ = Scene::build(std::span<const MeshView>(views), device, cancellable);
    });
    for (BorrowedMesh& mesh : meshes) {
        mesh.forget_colours();
        meshes_.emplace(static_cast<std::uint32_t>(meshes_.size()), std::move(mesh));
    }
    next_meshes_ = meshes_;
}

/// Runs `work`, which may build a tree over so many triangles. Handlers of signals can end the
/// building; a scene is then of no use any more. They may raise when `work` is done, too.
void PyScene::build_interruptibly(std::size_t triangles, const std::function<void()>& work) {
    // Work that builds no tree has not looked at it.
    cancel_build_ = false;
    if (triangles >= kManyTriangles) {
        run_interruptibly(cancel_build_, work);
        return;
    }
    const GilRelease release;
    work();
}

/// Cancels a background build and waits for its end.
PyScene::~PyScene() {
    const GilRelease release;
    scene_.reset();
}

Update PyScene::update(bool takes_bounds) {
    const ChangeUse use(uses_);
    Update update;
    Meshes meshes = next_meshes_;
    std::size_t triangles = 0;
    for (const auto& [geom_id, mesh] : next_meshes_) triangles += mesh.triangles->size() / 3;
    build_interruptibly(triangles, [&] {
        update = takes_bounds ? scene_->update_with_new_bounds() : scene_->update();
        meshes_.swap(meshes);
    });
    return update;
}

Update PyScene::update(std::uint32_t geom_id, std::size_t first, std::optional<std::size_t> count) {
    const ChangeUse use(uses_);
    if (!count) {
        const auto mesh = meshes_.find(geom_id);
        const std::size_t all = mesh == meshes_.end() ? 0 : mesh->second.positions.count;
        count = all - std::min(first, all);
    }
    Update update;
    build_interruptibly(scene_->triangle_count(),
                        [&] { update = scene_->update(geom_id, first, *count); });
    return update;
}

std::uint32_t PyScene::attach(BorrowedMesh mesh) {
    const ChangeUse use(uses_);
    std::uint32_t geom_id = 0;
    {
        const GilRelease release;
        geom_id = scene_->attach(mesh.view());
    }
    mesh.forget_colours();
    next_meshes_.insert_or_assign(geom_id, std::move(mesh));
    return geom_id;
}

void PyScene::detach(std::uint32_t geom_id) {
    const ChangeUse use(uses_);
    scene_->detach(geom_id);
    next_meshes_.erase(geom_id);
}

/// Whether tracing this many rays may take more than some milliseconds.
bool PyScene::is_long(std::size_t rays) const {
    if (rays >= kManyRays) return true;
    return scene_->device().name() == "brute" && rays * scene_->triangle_count() >= kManyTests;
}

void PyScene::intersect(const QueryArray& rays, Coherence coherence, std::span<Hit> hits) {
    const QueryUse use(uses_);
    trace(is_long(rays.count), nullptr, [&](const std::atomic<bool>* cancel) {
        for_each_batch(rays, batch_size(rays, coherence), 0, kInfinity,
                       [&](std::size_t first, std::span<const Ray> batch) {
                           scene_->intersect(batch, hits.subspan(first, batch.size()), coherence,
                                             cancel);
                       });
    });
}

void PyScene::occluded(const QueryArray& rays, Coherence coherence, float tnear, float tfar,
                       std::span<std::uint8_t> occluded) {
    const QueryUse use(uses_);
    trace(is_long(rays.count), nullptr, [&](const std::atomic<bool>* cancel) {
        for_each_batch(rays, batch_size(rays, coherence), tnear, tfar,
                       [&](std::size_t first, std::span<const Ray> batch) {
                           scene_->occluded(batch, occluded.subspan(first, batch.size()), coherence,
                                            cancel);
                       });
    });
}

void PyScene::cast(const QueryArray& rays, Coherence coherence, const CastHits& out) {
    const QueryUse use(uses_);
    // By geom_id.
    std::vector<Corners> meshes(meshes_.empty() ? 0 : std::size_t{meshes_.rbegin()->first} + 1);
    for (const auto& [geom_id, mesh] : meshes_) meshes[geom_id] = {mesh.positions, *mesh.triangles};
    trace(is_long(rays.count), nullptr, [&](const std::atomic<bool>* cancel) {
        std::vector<Hit> hits;
        for_each_batch(rays, converted_size(coherence), 0, kInfinity,
                       [&](std::size_t first, std::span<const Ray> batch) {
                           hits.resize(batch.size());
                           scene_->intersect(batch, std::span<Hit>(hits), coherence, cancel);
                           write_cast(hits, first, meshes, out);
                       });
    });
}

void PyScene::ask(const QueryArray& queries, Cancel* cancel,
                  const std::function<void(const Scene&, const std::atomic<bool>*)>& work) {
    const QueryUse use(uses_);
    const bool is_long =
        queries.count >= kManyRays || queries.count * scene_->triangle_count() >= kManyTests;
    trace(is_long, cancel, [&](const std::atomic<bool>* cancelled) { work(*scene_, cancelled); });
}

Comparison PyScene::compare(PyScene& other, const QueryArray& rays, std::size_t keep) {
    const QueryUse use(uses_);
    const QueryUse use_of_other(other.uses_);
    Comparison result;
    const auto compare_batch = [&](std::size_t first, std::span<const Ray> batch,
                                   const std::atomic<bool>* cancel) {
        const std::size_t room = keep - result.differences.size();
        Comparison part = morphray::compare(*scene_, *other.scene_, batch, room, cancel);
        result.compared += part.compared;
        result.different += part.different;
        for (HitDifference& difference : part.differences) {
            difference.index += first;
            result.differences.push_back(difference);
        }
    };
    trace(is_long(rays.count) || other.is_long(rays.count), nullptr,
          [&](const std::atomic<bool>* cancel) {
              for_each_batch(rays, batch_size(rays, {}), 0, kInfinity,
                             [&](std::size_t first, std::span<const Ray> batch) {
                                 compare_batch(first, batch, cancel);
                             });
          });
    return result;
}

Image PyScene::render(View view, Cancel* cancel) {
    const QueryUse use(uses_);
    std::atomic<bool> cancelled = false;
    const Cancel::Use use_of_cancel(cancel, cancelled);
    view.cancel = &cancelled;
    Image image;
    run_interruptibly(cancelled, [&] { image = scene_->render(view); });
    return image;
}

std::unique_ptr<PyScene> PyScene::on(const Device& device) {
    const QueryUse use(uses_);
    std::unique_ptr<PyScene> twin(new PyScene);
    twin->meshes_ = meshes_;
    twin->next_meshes_ = next_meshes_;
    const GilRelease release;
    twin->scene_ = scene_->on(device, &twin->cancel_build_);
    return twin;
}

}  // namespace morphray::python
