#include "library/src/lit_image.h"

#include <tbb/blocked_range.h>

#include <algorithm>

#include "common/image/depth.h"
#include "common/interop/camera.h"
#include "common/interop/shading.h"
#include "common/interop/surface.h"
#include "cpu/image/lit_shader.h"
#include "cpu/image/pixel_shader.h"
#include "library/src/engine.h"
#include "library/src/scene_impl.h"

namespace morphray::detail {
namespace {

using mray::LitKind;

/// Both name the kinds in one order.
static_assert(static_cast<int>(Shading::prim) == static_cast<int>(LitKind::kPrim));

mray::vec3 unit_vector(const Point& p) {
    const double length = std::hypot(p[0], p[1], p[2]);
    return {static_cast<float>(p[0] / length), static_cast<float>(p[1] / length),
            static_cast<float>(p[2] / length)};
}

// Rays in a batch: 8 MiB.
constexpr std::size_t kMostRays = std::size_t{1} << 18;

struct SampleBatch {
    std::vector<mray::Ray> rays;
    std::vector<std::size_t> samples;

    void add(const mray::Ray& ray, std::size_t sample) {
        rays.push_back(ray);
        samples.push_back(sample);
    }
};

/// Makes batches of the rays of an image's samples and answers them. Not thread-safe.
class SampleRays {
public:
    SampleRays(SceneImpl& scene, const mray::Watch& watch, const mray::ImageParams& params)
        : scene_(scene), watch_(watch), params_(params) {
        if (scene.meshes().has_alpha_test()) textures_ = scene.meshes().textures();
    }

    /// Calls ask(y, batch), which adds up to `most` rays a sample, for each row in many threads,
    /// and answer(batch) with the rays of some rows at a time, from the top down.
    template <class Ask, class Answer>
    void in_rows(std::size_t most, const Ask& ask, const Answer& answer) {
        const auto band = static_cast<std::uint32_t>(
            std::clamp<std::size_t>(kMostRays / (params_.width * most), 1, params_.height));
        std::vector<SampleBatch> rows(band);
        SampleBatch batch;
        for (std::uint32_t begin = 0; begin < params_.height; begin += band) {
            watch_.throw_if_cancelled();
            const std::uint32_t count = std::min(band, params_.height - begin);
            for_each_index(&scene_.arena(), count, [&](std::size_t i) {
                rows[i].rays.clear();
                rows[i].samples.clear();
                ask(begin + static_cast<std::uint32_t>(i), rows[i]);
            });
            batch.rays.clear();
            batch.samples.clear();
            for (const SampleBatch& row : std::span(rows).first(count)) {
                batch.rays.insert(batch.rays.end(), row.rays.begin(), row.rays.end());
                batch.samples.insert(batch.samples.end(), row.samples.begin(), row.samples.end());
            }
            if (!batch.rays.empty()) answer(std::as_const(batch));
        }
    }
    /// As in_rows(), with ask(x, y, sample, batch) for each sample.
    template <class Ask, class Answer>
    void in_batches(std::size_t most, const Ask& ask, const Answer& answer) {
        const auto ask_row = [&](std::uint32_t y, SampleBatch& batch) {
            for (std::uint32_t x = 0; x < params_.width; ++x)
                ask(x, y, std::size_t{y} * params_.width + x, batch);
        };
        in_rows(most, ask_row, answer);
    }

    mray::Surface surface(std::uint32_t x, std::uint32_t y, const mray::Hit& hit) const {
        return mray::cpu::ShadedMesh{&scene_.meshes().topology(), scene_.pose().positions()}
            .surface(mray::camera_ray(params_.camera, x, y), hit);
    }
    bool is_in_hole(const mray::Hit& hit) const {
        return mray::cpu::fails_alpha_test(textures_, hit);
    }

    /// For each ray 1 if it hits anything that is in no hole, else 0; valid until the next call.
    std::span<const std::uint8_t> occluded(std::span<const mray::Ray> rays) {
        occluded_.resize(rays.size());
        ray_count_ += rays.size();
        if (textures_.textures.empty()) {
            scene_.tracer().trace({rays, {}, occluded_});
            return occluded_;
        }
        std::vector<mray::Hit> hits(rays.size());
        scene_.tracer().trace({rays, hits});
        follow(rays, hits);
        for (std::size_t i = 0; i < hits.size(); ++i)
            occluded_[i] = hits[i].prim_id == mray::kNoPrim ? 0 : 1;
        return occluded_;
    }
    void count_occluded(const SampleBatch& batch, std::span<std::uint32_t> counts) {
        const std::span<const std::uint8_t> is_occluded = occluded(batch.rays);
        for (std::size_t i = 0; i < is_occluded.size(); ++i)
            counts[batch.samples[i]] += is_occluded[i];
    }

    /// Replaces each hit of a ray that is in a hole by the next one of its ray that is not.
    void follow(std::span<const mray::Ray> rays, std::span<mray::Hit> hits) {
        const std::size_t grain = std::max<std::size_t>(256, scene_.tracer().info().call_size);
        using Range = tbb::blocked_range<std::size_t>;
        scene_.arena().execute([&] {
            tbb::parallel_for(
                Range(0, hits.size(), grain),
                [&](const Range& r) {
                    follow_part(rays.subspan(r.begin(), r.size()),
                                hits.subspan(r.begin(), r.size()));
                },
                tbb::simple_partitioner());
        });
    }

    std::uint64_t ray_count() const { return ray_count_; }

private:
    void follow_part(std::span<const mray::Ray> all, std::span<mray::Hit> hits) {
        std::vector<std::size_t> open;
        for (std::size_t i = 0; i < hits.size(); ++i)
            if (is_in_hole(hits[i])) open.push_back(i);
        std::vector<mray::Ray> rays;
        std::vector<mray::HitCursor> after;
        std::vector<mray::Hit> next;
        while (!open.empty()) {
            rays.clear();
            after.clear();
            for (const std::size_t i : open) {
                rays.push_back(all[i]);
                after.push_back({hits[i].t, hits[i].prim_id});
            }
            next.resize(open.size());
            scene_.tracer().query(mray::NextQuery{rays, after, mray::Crossing::kEach, next});
            ray_count_ += open.size();
            for (std::size_t k = 0; k < open.size(); ++k) hits[open[k]] = next[k];
            std::erase_if(open, [&](std::size_t i) { return !is_in_hole(hits[i]); });
        }
    }

    SceneImpl& scene_;
    const mray::Watch& watch_;
    const mray::ImageParams& params_;
    /// Empty if no texture makes holes.
    mray::cpu::TexturedTriangles textures_;
    std::vector<std::uint8_t> occluded_;
    std::atomic<std::uint64_t> ray_count_ = 0;
};

/// Replaces each hit in a hole by the next hit of its ray: camera rays first, then shadow rays and
/// rays of the sky. Returns the number of rays.
std::uint64_t apply_alpha_test(SceneImpl& scene, const mray::Watch& watch, TracedImage& image) {
    const mray::ImageParams& params = image.params;
    const std::span<mray::Hit> hits = image.samples.hits;
    SampleRays rays(scene, watch, params);
    // Whether the camera ray of a sample passed a hole.
    std::vector<std::uint8_t> is_changed(hits.size());
    const auto follow_hole = [&](std::uint32_t x, std::uint32_t y, std::size_t sample,
                                 SampleBatch& batch) {
        if (rays.is_in_hole(hits[sample])) batch.add(mray::camera_ray(params.camera, x, y), sample);
    };
    rays.in_batches(1, follow_hole, [&](const SampleBatch& batch) {
        std::vector<mray::Hit> found;
        for (const std::size_t sample : batch.samples) found.push_back(hits[sample]);
        rays.follow(batch.rays, found);
        for (std::size_t i = 0; i < found.size(); ++i) {
            hits[batch.samples[i]] = found[i];
            is_changed[batch.samples[i]] = 1;
        }
    });
    // Holes change nothing for a sample without occluded rays whose surface is the same.
    const auto count_again = [&](std::span<std::uint32_t> occluded, std::size_t most,
                                 const auto& add_rays) {
        const auto ask = [&](std::uint32_t x, std::uint32_t y, std::size_t sample,
                             SampleBatch& batch) {
            if (is_changed[sample] == 0 && occluded[sample] == 0) return;
            occluded[sample] = 0;
            if (hits[sample].prim_id != mray::kNoPrim)
                add_rays(rays.surface(x, y, hits[sample]), x, y, sample, batch);
        };
        rays.in_batches(most, ask,
                        [&](const SampleBatch& batch) { rays.count_occluded(batch, occluded); });
    };
    const std::span<std::uint32_t> shadows = image.samples.occlusion;
    count_again(shadows, 1,
                [&](const mray::Surface& surface, std::uint32_t, std::uint32_t, std::size_t sample,
                    SampleBatch& batch) {
                    if (mray::faces_light(surface, params.light))
                        batch.add(mray::shadow_ray(surface, params.light), sample);
                    else
                        shadows[sample] = 1;
                });
    if (image.has_sky) {
        count_again(image.sky.occlusion, params.ao_count,
                    [&](const mray::Surface& surface, std::uint32_t x, std::uint32_t y,
                        std::size_t sample, SampleBatch& batch) {
                        for (std::uint32_t k = 0; k < params.ao_count; ++k)
                            batch.add(mray::ao_ray(surface, x, y, k, params.ao_tfar), sample);
                    });
    }
    return rays.ray_count();
}

/// Removes shadows that only the flatness of triangles makes. A sample in shadow whose smooth
/// normal faces the light is traced again from the smooth surface above it (smooth_surface() of
/// common/interop/shading.h). It is in the light if nothing lies between the light and that point,
/// nor between that point and the triangle. The view has normals. Returns the number of rays.
std::uint64_t light_smooth_surfaces(SceneImpl& scene, const mray::Watch& watch,
                                    const mray::cpu::LitSamples& samples,
                                    std::span<std::uint32_t> shadows) {
    // A shadow whose smooth surface sees the light.
    constexpr std::uint32_t kSeesLight = 2;
    const mray::ImageParams& params = samples.view.params;
    SampleRays rays(scene, watch, params);
    const mray::cpu::LitShader shader(scene.target());
    const mray::VertexNormals& smooth = *samples.view.normals;
    /// Adds ray_of(flat, above) for a sample, if a smooth surface is above it.
    const auto add_ray = [&](std::uint32_t x, std::uint32_t y, SampleBatch& batch, auto ray_of) {
        const std::size_t sample = std::size_t{y} * params.width + x;
        const mray::Hit& hit = samples.hits[sample];
        if (smooth.ids()[hit.prim_id] == mray::uvec3(mray::kFlatCorner)) return;
        const mray::Surface flat = rays.surface(x, y, hit);
        const mray::uvec3 t = samples.topology.triangles[hit.prim_id];
        const auto [a, b, c] = corner_normals(smooth, hit.prim_id, flat.normal);
        const mray::Surface above =
            mray::smooth_surface(flat, samples.positions[t.x], samples.positions[t.y],
                                 samples.positions[t.z], a, b, c, hit.u, hit.v);
        batch.add(ray_of(flat, above), sample);
    };
    const auto from_light = [&](std::uint32_t y, SampleBatch& batch) {
        std::vector<std::uint32_t> xs;
        shader.find_flat_shadows(samples, y, xs);
        for (const std::uint32_t x : xs) {
            add_ray(x, y, batch, [&](const mray::Surface&, const mray::Surface& above) {
                return mray::shadow_ray(above, params.light);
            });
        }
    };
    rays.in_rows(1, from_light, [&](const SampleBatch& batch) {
        const std::span<const std::uint8_t> is_occluded = rays.occluded(batch.rays);
        for (std::size_t i = 0; i < is_occluded.size(); ++i)
            if (is_occluded[i] == 0) shadows[batch.samples[i]] = kSeesLight;
    });
    const auto from_triangle = [&](std::uint32_t x, std::uint32_t y, std::size_t sample,
                                   SampleBatch& batch) {
        if (shadows[sample] != kSeesLight) return;
        shadows[sample] = 0;
        add_ray(x, y, batch, mray::ray_between);
    };
    rays.in_batches(1, from_triangle,
                    [&](const SampleBatch& batch) { rays.count_occluded(batch, shadows); });
    return rays.ray_count();
}

/// The view of the samples, `side` times `side` a pixel.
mray::ViewSpec sampled_spec(const View& view, const Point& origin, std::uint32_t side) {
    mray::ViewSpec spec = engine::to_spec(view, origin);
    // More than this is refused.
    constexpr std::uint32_t kMostPixels = 1u << 20;
    spec.width = std::min(view.width, kMostPixels) * side;
    spec.height = std::min(view.height, kMostPixels) * side;
    if (auto& pinhole = spec.pinhole)
        for (double* const pixels : {&pinhole->fx, &pinhole->fy, &pinhole->cx, &pinhole->cy})
            *pixels *= side;
    const bool is_lit = view.shading == Shading::lit;
    if (view.shading != Shading::plain) spec.rays = is_lit ? mray::kRaysShadow : mray::kRaysPrimary;
    if (is_lit) spec.ao_count = std::max(view.ao_count, 1u);
    return spec;
}

/// Traces the samples of `traced.params`, and their sky in lit images with ambient occlusion.
void trace_samples(mray::Backend& backend, const View& view, const mray::Watch& watch,
                   TracedImage& traced, Image& image) {
    traced.has_sky = view.shading == Shading::lit && view.ao_count > 0;
    traced.samples.with_pixels = view.shading == Shading::plain;
    traced.samples.with_hits = true;
    traced.sky.with_pixels = false;
    // The sky takes most of the time.
    if (traced.has_sky) backend.watch_images(mray::Watch(view.cancel));
    backend.trace_image(traced.params, traced.samples);
    image.ray_count = backend.finish().rays;
    image.trace_ms = backend.finish().trace_ms;
    if (!traced.has_sky) return;
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

void shade(const SceneImpl& scene, const mray::cpu::LitSamples& samples, const mray::Watch& watch,
           Image& image) {
    const mray::cpu::LitShader shader(scene.target());
    const mray::LitView& view = samples.view;
    const std::uint32_t width = view.params.width / view.side;
    const std::uint32_t height = view.params.height / view.side;
    // Rows of samples in a band, of which few are shared with its neighbours.
    constexpr std::uint32_t kBandRows = 32;
    const std::uint32_t band = kBandRows / view.side;
    for_each_index(&scene.arena(), (height + band - 1) / band, [&](std::size_t i) {
        watch.throw_if_cancelled();
        const std::uint32_t begin = static_cast<std::uint32_t>(i) * band;
        const std::size_t first = std::size_t{begin} * width;
        shader.shade_rows(samples, begin, std::min(begin + band, height),
                          image.pixels.data() + first,
                          image.linear.empty() ? nullptr : &image.linear[first]);
    });
}

/// Returns false where the host has to shade.
bool render_on_device(SceneImpl& scene, const mray::LitView& lit, bool with_hits,
                      TracedImage& traced, Image& image) {
    // A level of a texture is found in doubles.
    if (lit.kind == LitKind::kLit && !scene.meshes().textures().textures.empty()) return false;
    traced.has_sky = false;
    traced.samples.with_hits = with_hits;
    mray::Backend& backend = scene.tracer();
    if (!backend.trace_lit(lit, traced.samples, image.pixels, image.linear)) return false;
    image.ray_count = backend.finish().rays;
    image.trace_ms = backend.finish().trace_ms;
    image.shade_ms = backend.finish().shade_ms;
    return true;
}

void shade_on_host(SceneImpl& scene, const mray::Watch& watch, const mray::LitView& lit,
                   TracedImage& traced, Image& image) {
    const MeshList& meshes = scene.meshes();
    const bool is_lit = lit.kind == LitKind::kLit;
    mray::Stopwatch stopwatch;
    if (is_lit && meshes.has_alpha_test())
        image.ray_count += apply_alpha_test(scene, watch, traced);
    const mray::cpu::LitSamples samples{.view = lit,
                                        .topology = meshes.topology(),
                                        .positions = scene.pose().positions(),
                                        .textures = meshes.textures(),
                                        .hits = traced.samples.hits,
                                        .shadows = traced.samples.occlusion,
                                        .occlusion = traced.sky.occlusion,
                                        .colours = traced.samples.pixels};
    if (is_lit && lit.normals != nullptr)
        image.ray_count += light_smooth_surfaces(scene, watch, samples, traced.samples.occlusion);
    if (is_lit) {
        image.trace_ms += stopwatch.ms();
        stopwatch = mray::Stopwatch();
    }
    shade(scene, samples, watch, image);
    image.shade_ms = stopwatch.ms();
    image.trace_ms += image.shade_ms;
}

}  // namespace

void render_lit(SceneImpl& scene, const View& view, const mray::Watch& watch, TracedImage& traced,
                Image& image) {
    const MeshList& meshes = scene.meshes();
    const PoseReader& pose = scene.pose();
    if (view.shading < Shading::plain || view.shading > Shading::prim)
        throw_bad_argument("View::shading: not one of plain, lit, normal, depth and prim");
    const auto kind = static_cast<LitKind>(view.shading);
    const bool is_lit = kind == LitKind::kLit;
    const bool is_smooth = (is_lit || kind == LitKind::kNormal) && !view.flat;
    const std::uint32_t side = sample_side(view.samples);
    if (side * side != view.samples)
        throw_bad_argument("View::samples: {}, which is not one of 1, 4, 16 and 64", view.samples);
    const mray::ViewSpec spec = sampled_spec(view, scene.options().origin, side);
    traced.params = mray::make_image_params(spec, pose.bounds(), pose.space());
    const mray::ResolvedView seen = mray::resolve_view(spec, pose.bounds());
    const mray::DepthRange depths = mray::depth_range(seen.eye, seen.target, pose.bounds());
    mray::Stopwatch stopwatch;
    const mray::LitView lit{
        .params = traced.params,
        .side = side,
        .kind = kind,
        .up = unit_vector(view.up),
        .near = static_cast<float>(pose.space().length_to_scene(depths.near)),
        .per_depth = static_cast<float>(1 / pose.space().length_to_scene(depths.range)),
        .ao_count = is_lit ? view.ao_count : 0,
        .normals = is_smooth && meshes.is_smooth() ? &scene.normals() : nullptr};
    const double normals_ms = stopwatch.ms();
    image.pixels.resize(std::size_t{view.width} * view.height);
    image.linear.resize(is_lit && view.linear ? image.pixels.size() : 0);
    if (!render_on_device(scene, lit, view.hits, traced, image)) {
        trace_samples(scene.tracer(), view, watch, traced, image);
        shade_on_host(scene, watch, lit, traced, image);
    }
    image.trace_ms += normals_ms;
}

}  // namespace morphray::detail
