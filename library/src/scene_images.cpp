// The members of Scene that make images, and that describe the tree.
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "common/bvh/box.h"
#include "common/bvh/bvh.h"
#include "common/image/depth.h"
#include "library/src/scene_impl.h"

namespace morphray {
namespace detail {

mray::ViewSpec to_spec(const View& view, const Point& origin) {
    static_assert(static_cast<std::uint32_t>(Rays::ao) == mray::kRaysAo);
    if (view.rays < Rays::primary || view.rays > Rays::ao)
        throw_bad_argument("View::rays: not one of primary, shadow and ao");
    const auto less_origin = [&](std::optional<Point> point) {
        for (std::size_t axis = 0; point && axis < 3; ++axis) (*point)[axis] -= origin[axis];
        return point;
    };
    return {.eye = less_origin(view.eye),
            .target = less_origin(view.target),
            .up = view.up,
            .fov = view.fov,
            .light = less_origin(view.light),
            .width = view.width,
            .height = view.height,
            .rays = static_cast<std::uint32_t>(view.rays),
            .ao_count = view.ao_count,
            .ao_distance = view.ao_distance};
}

}  // namespace detail

namespace {

using detail::SceneImpl;
using detail::TracedImage;
using detail::with_scene;

// The most samples whose memory is kept for the next image: 340 MB with the sky's.
constexpr std::size_t kMostSpareSamples = std::size_t{1} << 23;

/// Fills hits, occlusion and both hashes of an image whose pixels are there; without hits as
/// View::hits says. Throws Error(kCancelled) between rows.
void fill_hits(SceneImpl& scene, bool with_hits, TracedImage& traced, const mray::Watch& watch,
               Image& image) {
    mray::Frame& frame = traced.samples;
    if (!with_hits) {
        image.hits.clear();
        image.occlusion.clear();
        image.hits_hash = 0;
        image.image_hash = mray::image_hash(image.pixels);
        return;
    }
    mray::resize_watched(image.hits, frame.hits.size(), watch);
    mray::resize_watched(image.occlusion, frame.occlusion.size(), watch);
    const auto convert_row = [&](std::uint32_t y) {
        watch.throw_if_cancelled();
        for (std::uint32_t x = 0; x < frame.width; ++x) {
            const std::size_t i = std::size_t{y} * frame.width + x;
            const mray::Hit& hit = frame.hits[i];
            image.occlusion[i] = frame.occlusion[i];
            image.hits[i] =
                hit.prim_id == mray::kNoPrim
                    ? Hit{}
                    : scene.meshes.locate(
                          mray::world_depth(traced.params.camera, scene.pose.space(), hit.t, x, y),
                          hit.u, hit.v, hit.prim_id);
        }
    };
    const auto add_sky = [&](std::uint32_t y) {
        const std::size_t end = std::size_t{y + 1} * frame.width;
        for (std::size_t i = end - frame.width; i < end; ++i)
            frame.occlusion[i] += traced.sky.occlusion[i];
    };
    scene.arena().execute([&] {
        if (traced.has_sky) tbb::parallel_for(std::uint32_t{0}, frame.height, add_sky);
        tbb::parallel_invoke(
            [&] { tbb::parallel_for(std::uint32_t{0}, frame.height, convert_row); },
            [&] { image.hits_hash = mray::hits_hash(frame); },
            [&] { image.image_hash = mray::image_hash(image.pixels); });
    });
}

/// At 0 the box around everything, at 1 those of the root's children, and so on, without empty
/// ones. Leaves above the depth are left out; there is nothing below the tree.
std::vector<mray::Box> boxes_at_depth(const mray::Bvh& tree, std::uint32_t depth) {
    if (depth > tree.depth()) return {};
    const mray::Box root = mray::node_box(tree.nodes.front());
    std::vector<mray::Box> boxes;
    if (depth == 0 && !root.empty()) boxes.push_back(root);
    if (depth == 0) return boxes;
    // The slots of a level hold the boxes of the next one.
    for (std::uint32_t i = tree.level_begin[depth - 1]; i < tree.level_begin[depth]; ++i) {
        for (std::uint32_t slot = 0; slot < mray::kWidth; ++slot) {
            const mray::Box box = mray::slot_box(tree.nodes[i], slot);
            if (!box.empty()) boxes.push_back(box);
        }
    }
    return boxes;
}

/// An image of one sample a pixel in the colours of the backend.
void render_plain(SceneImpl& scene, const View& view, TracedImage& traced, Image& image) {
    traced.params = mray::make_image_params(detail::to_spec(view, scene.options.origin),
                                            scene.pose.bounds(), scene.pose.space());
    traced.has_sky = false;
    traced.samples.with_pixels = true;
    traced.samples.with_hits = view.hits;
    scene.tracer->trace_image(traced.params, traced.samples);
    image.ray_count = scene.tracer->finish().rays;
    image.trace_ms = scene.tracer->finish().trace_ms;
    image.shade_ms = 0;
    const mray::Frame& frame = traced.samples;
    image.pixels.resize(frame.pixels.size());
    scene.arena().execute([&] {
        tbb::parallel_for(std::uint32_t{0}, frame.height, [&](std::uint32_t y) {
            const std::size_t first = std::size_t{y} * frame.width;
            std::copy_n(&frame.pixels[first], frame.width, &image.pixels[first]);
        });
    });
    image.lit_pixels.clear();
}

}  // namespace

Image Scene::render(const View& view) const {
    Image image;
    render(view, image);
    return image;
}

void Scene::render(const View& view, Image& image) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        TracedImage traced;
        const mray::Watch watch(view.cancel, view.progress);
        {
            const std::scoped_lock lock(scene.mutex);
            scene.tracer->watch_images(watch);
            if (view.shading != Shading::plain || view.samples != 1) {
                render_lit(scene, view, watch, scene.spare, image);
            } else {
                render_plain(scene, view, scene.spare, image);
            }
            std::swap(traced, scene.spare);
        }
        fill_hits(scene, view.hits, traced, watch, image);
        image.width = view.width;
        image.height = view.height;
        image.samples = view.samples;
        scene.cost.add(image.trace_ms, image.ray_count);
        if (traced.samples.hits.size() > kMostSpareSamples) return;
        const std::scoped_lock lock(scene.mutex);
        scene.spare = std::move(traced);
    });
}

TreeStatistics Scene::tree_statistics() const {
    return with_scene(impl_, [](SceneImpl& scene) -> TreeStatistics {
        const std::scoped_lock lock(scene.mutex);
        const mray::Bvh& tree = scene.tree();
        const mray::BvhStats stats = mray::bvh_stats(tree);
        return {stats.sah_cost, stats.node_count, stats.leaf_count,
                stats.depth,    stats.bytes,      mray::bvh_hash(tree)};
    });
}

std::vector<Box> Scene::tree_boxes(std::uint32_t depth) const {
    return with_scene(impl_, [&](SceneImpl& scene) {
        const std::scoped_lock lock(scene.mutex);
        std::vector<Box> boxes;
        for (const mray::Box& box : boxes_at_depth(scene.tree(), depth)) {
            const auto corner = [&](const mray::vec3& p) {
                const glm::dvec3 world(scene.pose.space().to_world(p));
                return mray::to_point(scene.pose.origin().from_world(world));
            };
            boxes.push_back({corner(box.lower), corner(box.upper)});
        }
        return boxes;
    });
}

Box Scene::bounds() const {
    return with_scene(impl_, [](SceneImpl& scene) {
        glm::dvec3 lower(std::numeric_limits<double>::infinity());
        glm::dvec3 upper = -lower;
        const std::span<const mray::vec3> positions = scene.pose.positions();
        for (std::uint32_t vertex = 0; vertex < positions.size(); ++vertex) {
            if (positions[vertex].x == mray::kInvalidCoordinate) continue;
            const glm::dvec3 p =
                scene.pose.origin().from_world(glm::dvec3(scene.pose.world_position(vertex)));
            lower = glm::min(lower, p);
            upper = glm::max(upper, p);
        }
        return Box{mray::to_point(lower), mray::to_point(upper)};
    });
}

}  // namespace morphray
