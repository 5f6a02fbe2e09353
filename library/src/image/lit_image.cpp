// Images with several samples a pixel, lit or in false colours.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/frame_times.h"
#include "common/image/depth.h"
#include "common/image/heat_colours.h"
#include "common/interop/camera.h"
#include "cpu/image/lit_shader.h"
#include "cpu/reference/scalar_tracer.h"
#include "library/src/scene_impl.h"

namespace morphray::detail {
namespace {

using mray::cpu::LitKind;

/// Both name the kinds up to prim in one order; the others are coloured by the tree.
static_assert(static_cast<int>(Shading::prim) == static_cast<int>(LitKind::kPrim));

LitKind kind_of(Shading shading) {
    if (shading < Shading::plain || shading > Shading::sah) {
        throw_bad_argument(
            "View::shading: not one of plain, lit, normal, depth, prim, steps and sah");
    }
    return shading > Shading::prim ? LitKind::kPlain : static_cast<LitKind>(shading);
}

std::uint32_t checked_side(std::uint32_t samples) {
    const std::uint32_t side = sample_side(samples);
    if (side * side != samples) {
        throw_bad_argument("View::samples: {}, which is not one of 1, 4, 16 and 64", samples);
    }
    return side;
}

mray::vec3 unit_vector(const Point& p) {
    const double length = std::hypot(p[0], p[1], p[2]);
    return {static_cast<float>(p[0] / length), static_cast<float>(p[1] / length),
            static_cast<float>(p[2] / length)};
}

/// Colours the samples by what the tree costs there; black without a hit, but for steps.
void colour_by_tree(SceneImpl& scene, Shading shading, const mray::Watch& watch,
                    TracedImage& image) {
    const mray::Bvh& tree = scene.tree();
    const bool is_steps = shading == Shading::steps;
    const std::vector<float> looseness =
        is_steps ? std::vector<float>() : mray::cpu::leaf_looseness(tree);
    const std::uint32_t width = image.params.width;
    const auto colour = [&](std::uint32_t x, std::uint32_t y, const mray::Hit& hit) {
        if (is_steps) {
            const mray::Ray ray = mray::camera_ray(image.params.camera, x, y);
            return mray::steps_colour(mray::cpu::count_steps(tree, ray, hit));
        }
        if (hit.prim_id == mray::kNoPrim) return 0xFF000000u;
        return mray::looseness_colour(looseness[hit.prim_id]);
    };
    mray::resize_watched(image.samples.pixels, image.samples.hits.size(), watch);
    scene.arena().execute([&] {
        tbb::parallel_for(std::uint32_t{0}, image.params.height, [&](std::uint32_t y) {
            watch.throw_if_cancelled();
            for (std::uint32_t x = 0; x < width; ++x) {
                const std::size_t i = std::size_t{y} * width + x;
                image.samples.pixels[i] = colour(x, y, image.samples.hits[i]);
            }
        });
    });
}

}  // namespace

void render_lit(SceneImpl& scene, const View& view, const mray::Watch& watch, TracedImage& traced,
                Image& image) {
    const MeshList& meshes = scene.meshes;
    const PoseReader& pose = scene.pose;
    mray::Backend& backend = *scene.tracer;
    const LitKind kind = kind_of(view.shading);
    const bool is_lit = kind == LitKind::kLit;
    const bool is_smooth = (is_lit || kind == LitKind::kNormal) && !view.flat;
    const std::uint32_t side = checked_side(view.samples);
    mray::ViewSpec spec = to_spec(view, scene.options.origin);
    // More than this is refused.
    constexpr std::uint32_t kMostPixels = 1u << 20;
    spec.width = std::min(view.width, kMostPixels) * side;
    spec.height = std::min(view.height, kMostPixels) * side;
    const bool is_heat = view.shading == Shading::steps || view.shading == Shading::sah;
    if (view.shading != Shading::plain) spec.rays = is_lit ? mray::kRaysShadow : mray::kRaysPrimary;
    if (is_lit) spec.ao_count = std::max(view.ao_count, 1u);

    traced.params = mray::make_image_params(spec, pose.bounds(), pose.space());
    traced.has_sky = is_lit && view.ao_count > 0;
    traced.samples.with_pixels = view.shading == Shading::plain;
    traced.samples.with_hits = true;
    traced.sky.with_pixels = false;
    // The sky takes most of the time.
    if (traced.has_sky) backend.watch_images(mray::Watch(view.cancel));
    backend.trace_image(traced.params, traced.samples);
    image.ray_count = backend.finish().rays;
    image.trace_ms = backend.finish().trace_ms;
    if (traced.has_sky) {
        backend.watch_images(watch);
        mray::ImageParams params = traced.params;
        params.rays = mray::kRaysAo;
        traced.sky.hits = std::move(traced.samples.hits);
        traced.sky.has_hits = true;
        backend.trace_image(params, traced.sky);
        traced.samples.hits = std::move(traced.sky.hits);
        // The camera rays are the same, and count once.
        image.ray_count += backend.finish().rays - traced.samples.hits.size();
        image.trace_ms += backend.finish().trace_ms;
    }

    const bool has_smooth = is_smooth && meshes.is_smooth();
    mray::Stopwatch stopwatch;
    if (is_lit && meshes.has_alpha_test())
        image.ray_count += apply_alpha_test(scene, watch, traced);
    if (has_smooth) update_normals(scene);
    if (is_heat) colour_by_tree(scene, view.shading, watch, traced);
    const mray::ResolvedView seen = mray::resolve_view(spec, pose.bounds());
    const mray::DepthRange depths = mray::depth_range(seen.eye, seen.target, pose.bounds());
    const mray::cpu::LitSamples samples{
        .params = traced.params,
        .side = side,
        .kind = kind,
        .up = unit_vector(view.up),
        .near = static_cast<float>(pose.space().length_to_scene(depths.near)),
        .per_depth = static_cast<float>(1 / pose.space().length_to_scene(depths.range)),
        .topology = meshes.topology(),
        .positions = pose.positions(),
        .normal_ids = has_smooth ? scene.normals->ids() : std::span<const mray::uvec3>(),
        .normals = has_smooth ? scene.normals->normals() : std::span<const mray::vec3>(),
        .textures = meshes.textures(),
        .hits = traced.samples.hits,
        .shadows = traced.samples.occlusion,
        .occlusion = traced.sky.occlusion,
        .ao_count = traced.has_sky ? view.ao_count : 0,
        .colours = traced.samples.pixels};
    if (is_lit) {
        if (has_smooth) {
            image.ray_count +=
                light_smooth_surfaces(scene, watch, samples, traced.samples.occlusion);
        }
        image.trace_ms += stopwatch.ms();
        stopwatch = mray::Stopwatch();
    }
    image.pixels.resize(std::size_t{view.width} * view.height);
    static_assert(sizeof(LitPixel) == sizeof(mray::cpu::LitPixel));
    image.lit_pixels.resize(is_lit && view.lit_pixels ? image.pixels.size() : 0);
    // Rows of samples in a band: those that it shares with its neighbours are a small part of it.
    constexpr std::uint32_t kBandRows = 32;
    const std::uint32_t band = kBandRows / side;
    const std::uint32_t bands = (view.height + band - 1) / band;
    scene.arena().execute([&] {
        tbb::parallel_for(std::uint32_t{0}, bands, [&](std::uint32_t i) {
            watch.throw_if_cancelled();
            const std::uint32_t begin = i * band;
            const std::size_t first = std::size_t{begin} * view.width;
            auto* const details =
                image.lit_pixels.empty()
                    ? nullptr
                    : reinterpret_cast<mray::cpu::LitPixel*>(&image.lit_pixels[first]);
            scene.shader.shade_rows(samples, begin, std::min(begin + band, view.height),
                                    image.pixels.data() + first, details);
        });
    });
    image.shade_ms = stopwatch.ms();
    image.trace_ms += image.shade_ms;
}

}  // namespace morphray::detail
