#include "morphray/scene.hpp"

#include <utility>

#include "library/src/scene/errors.h"
#include "library/src/scene_impl.h"

namespace morphray {
namespace {

using detail::SceneImpl;
using detail::with_public_errors;

template <class Impl>
Impl& require(const std::unique_ptr<Impl>& impl) {
    if (impl == nullptr) detail::throw_bad_argument("this scene has been moved from");
    return *impl;
}

}  // namespace

const char* to_string(Step step) noexcept {
    switch (step) {
        case Step::build:
            return "build";
        case Step::keep:
            return "keep";
        case Step::refit:
            return "refit";
        case Step::restructure:
            return "restructure";
        case Step::rebuild:
            return "rebuild";
        default:
            return "swap";
    }
}

Scene::Scene(std::unique_ptr<SceneImpl> impl) : impl_(std::move(impl)) {}
Scene::Scene(Scene&& other) noexcept = default;
Scene& Scene::operator=(Scene&& other) noexcept = default;
Scene::~Scene() = default;

Scene Scene::build(const MeshView& mesh, const Device& device, const SceneOptions& options) {
    return build(std::span<const MeshView>(&mesh, 1), device, options);
}

Scene Scene::build(std::span<const MeshView> meshes, const Device& device,
                   const SceneOptions& options) {
    return with_public_errors(
        [&] { return Scene(std::make_unique<SceneImpl>(meshes, device, options)); });
}

Update Scene::update() {
    return with_public_errors([&] { return require(impl_).update(false); });
}

Update Scene::update(std::uint32_t geom_id, std::size_t first, std::size_t count) {
    return with_public_errors([&] { return require(impl_).update(geom_id, first, count); });
}

Update Scene::update_with_new_bounds() {
    return with_public_errors([&] { return require(impl_).update(true); });
}

std::uint32_t Scene::attach(const MeshView& mesh) {
    return with_public_errors([&] { return require(impl_).attach(mesh); });
}

void Scene::detach(std::uint32_t geom_id) {
    with_public_errors([&] { require(impl_).detach(geom_id); });
}

Update Scene::last_update() const {
    return with_public_errors([&] { return require(impl_).last_update(); });
}

void Scene::intersect(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence,
                      const std::atomic<bool>* cancel) const {
    with_public_errors(
        [&] { require(impl_).intersect(rays, hits, coherence, Threads::all, cancel); });
}

void Scene::intersect(std::span<const Ray> rays, std::span<Hit> hits, Threads threads,
                      Coherence coherence) const {
    with_public_errors([&] { require(impl_).intersect(rays, hits, coherence, threads, nullptr); });
}

Hit Scene::intersect(const Ray& ray) const {
    return with_public_errors([&] { return require(impl_).intersect(ray); });
}

void Scene::occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                     Coherence coherence, const std::atomic<bool>* cancel) const {
    with_public_errors(
        [&] { require(impl_).occluded(rays, occluded, coherence, Threads::all, cancel); });
}

void Scene::occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Threads threads,
                     Coherence coherence) const {
    with_public_errors(
        [&] { require(impl_).occluded(rays, occluded, coherence, threads, nullptr); });
}

bool Scene::occluded(const Ray& ray) const {
    return with_public_errors([&] { return require(impl_).occluded(ray); });
}

AllHits Scene::intersect_all(std::span<const Ray> rays, const AllHitsOptions& options) const {
    return with_public_errors(
        [&] { return require(impl_).questions().intersect_all(rays, options); });
}

Hit Scene::intersect_visible(const Ray& ray, std::span<const std::uint8_t> is_visible) const {
    return with_public_errors(
        [&] { return require(impl_).questions().intersect_visible(ray, is_visible); });
}

Hit Scene::intersect(const Ray& ray, const Hit& after, Crossing crossing) const {
    return with_public_errors(
        [&] { return require(impl_).questions().intersect(ray, after, crossing); });
}

void Scene::count(std::span<const Ray> rays, std::span<std::uint64_t> counts, Crossing crossing,
                  Coherence coherence, const std::atomic<bool>* cancel) const {
    with_public_errors(
        [&] { require(impl_).questions().count(rays, counts, crossing, coherence, cancel); });
}

void Scene::winding(std::span<const Vec3> points, std::span<std::int32_t> windings,
                    const std::atomic<bool>* cancel) const {
    with_public_errors([&] { require(impl_).questions().winding(points, windings, cancel); });
}

void Scene::contains(std::span<const Vec3> points, std::span<std::uint8_t> inside, FillRule rule,
                     const std::atomic<bool>* cancel) const {
    with_public_errors([&] { require(impl_).questions().contains(points, inside, rule, cancel); });
}

void Scene::closest_points(std::span<const Vec3> points, std::span<ClosestPoint> closest,
                           float max_distance, const std::atomic<bool>* cancel) const {
    with_public_errors(
        [&] { require(impl_).questions().closest_points(points, closest, max_distance, cancel); });
}

void Scene::signed_distance(std::span<const Vec3> points, std::span<float> distances, FillRule rule,
                            float max_distance, const std::atomic<bool>* cancel) const {
    with_public_errors([&] {
        require(impl_).questions().signed_distance(points, distances, rule, max_distance, cancel);
    });
}

Image Scene::render(const View& view) const {
    Image image;
    render(view, image);
    return image;
}

void Scene::render(const View& view, Image& image) const {
    with_public_errors([&] { require(impl_).render(view, image); });
}

Scene Scene::on(const Device& device, const std::atomic<bool>* cancel) const {
    return with_public_errors(
        [&] { return Scene(std::make_unique<SceneImpl>(require(impl_), device, cancel)); });
}

TreeStatistics Scene::tree_statistics() const {
    return with_public_errors([&] { return require(impl_).tree_statistics(); });
}

std::vector<Box> Scene::tree_boxes(std::uint32_t depth) const {
    return with_public_errors([&] { return require(impl_).tree_boxes(depth); });
}

const Device& Scene::device() const { return require(impl_).device(); }

std::uint64_t Scene::triangle_count() const { return require(impl_).topology().triangles.size(); }

std::uint64_t Scene::vertex_count() const { return require(impl_).topology().vertex_count; }

Box Scene::bounds() const {
    return with_public_errors([&] { return require(impl_).bounds(); });
}

}  // namespace morphray
