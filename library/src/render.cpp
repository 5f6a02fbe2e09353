#include "library/src/render.h"

#include <tbb/parallel_invoke.h>

#include "common/image/depth.h"
#include "library/src/engine.h"
#include "library/src/lit_image.h"
#include "library/src/scene_impl.h"

namespace morphray {
namespace {

using namespace detail;

/// An image of one sample a pixel in the colours of the backend.
void render_plain(SceneImpl& scene, const View& view, TracedImage& traced, Image& image) {
    traced.params = mray::make_image_params(engine::to_spec(view, scene.options().origin),
                                            scene.pose().bounds(), scene.pose().space());
    traced.has_sky = false;
    traced.samples.with_pixels = true;
    traced.samples.with_hits = view.hits;
    scene.tracer().trace_image(traced.params, traced.samples);
    image.ray_count = scene.tracer().finish().rays;
    image.trace_ms = scene.tracer().finish().trace_ms;
    image.shade_ms = 0;
    const mray::Frame& frame = traced.samples;
    image.pixels.resize(frame.pixels.size());
    for_each_index(&scene.arena(), frame.height, [&](std::size_t y) {
        std::copy_n(&frame.pixels[y * frame.width], frame.width, &image.pixels[y * frame.width]);
    });
    image.linear.clear();
}

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
                    : scene.meshes().locate(mray::world_depth(traced.params.camera,
                                                              scene.pose().space(), hit.t, x, y),
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

void render_view(SceneImpl& scene, const View& view, Image& image) {
    TracedImage traced = scene.image_memory.take();
    const mray::Watch watch(view.cancel, view.progress);
    {
        const std::scoped_lock lock(scene.mutex());
        scene.tracer().watch_images(watch);
        if (view.shading != Shading::plain || view.samples != 1) {
            render_lit(scene, view, watch, traced, image);
        } else {
            render_plain(scene, view, traced, image);
        }
    }
    fill_hits(scene, view.hits, traced, watch, image);
    image.width = view.width;
    image.height = view.height;
    image.samples = view.samples;
    scene.cost.add_image(image.trace_ms, image.ray_count);
    scene.image_memory.give_back(std::move(traced));
}

}  // namespace

Image Scene::render(const View& view) const {
    Image image;
    render(view, image);
    return image;
}
void Scene::render(const View& view, Image& image) const {
    with_scene(impl_, [&](SceneImpl& scene) { render_view(scene, view, image); });
}

}  // namespace morphray
