#include "library/src/render.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <bit>
#include <iterator>

#include "common/image/depth.h"
#include "common/interop/camera.h"
#include "common/interop/shading.h"
#include "common/interop/surface.h"
#include "cpu/image/lit_shader.h"
#include "cpu/image/pixel_shader.h"
#include "cpu/reference/scalar_tracer.h"
#include "library/src/engine.h"
#include "library/src/scene_impl.h"

namespace morphray::detail {

namespace {

using mray::cpu::LitKind;

/// Both name the kinds up to prim in one order; the tree colours the others.
static_assert(static_cast<int>(Shading::prim) == static_cast<int>(LitKind::kPrim));

mray::vec3 unit_vector(const Point& p) {
    const double length = std::hypot(p[0], p[1], p[2]);
    return {static_cast<float>(p[0] / length), static_cast<float>(p[1] / length),
            static_cast<float>(p[2] / length)};
}

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
    scene.arena().execute([&] {
        tbb::parallel_for(std::uint32_t{0}, frame.height, [&](std::uint32_t y) {
            const std::size_t first = std::size_t{y} * frame.width;
            std::copy_n(&frame.pixels[first], frame.width, &image.pixels[first]);
        });
    });
    image.lit_pixels.clear();
}

// Rays in a batch: 8 MiB.
constexpr std::size_t kMostRays = std::size_t{1} << 18;

struct SampleBatch {
    std::vector<mray::Ray> rays;
    std::vector<std::size_t> samples;

    void clear() {
        rays.clear();
        samples.clear();
    }
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
            scene_.arena().execute([&] {
                tbb::parallel_for(std::uint32_t{0}, count, [&](std::uint32_t i) {
                    rows[i].clear();
                    ask(begin + i, rows[i]);
                });
            });
            batch.clear();
            for (const SampleBatch& row : std::span(rows).first(count)) {
                batch.rays.insert(batch.rays.end(), row.rays.begin(), row.rays.end());
                batch.samples.insert(batch.samples.end(), row.samples.begin(), row.samples.end());
            }
            if (!batch.rays.empty()) answer(std::as_const(batch));
        }
    }
    /// The same with ask(x, y, sample, batch) for each sample.
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

/// The smooth surface above a hit of a flat one; nothing if all corners are flat.
std::optional<mray::Surface> surface_above(const mray::cpu::LitSamples& samples,
                                           const mray::Surface& flat, const mray::Hit& hit) {
    const mray::uvec3 ids = samples.normal_ids[hit.prim_id];
    const mray::uvec3 t = samples.topology.triangles[hit.prim_id];
    mray::vec3 places[3], normals[3];
    bool is_flat = true;
    for (int k = 0; k < 3; ++k) {
        places[k] = samples.positions[t[k]];
        normals[k] = flat.normal;
        if (ids[k] == mray::kFlatCorner) continue;
        normals[k] = mray::corner_normal(samples.normals[ids[k]], flat.normal);
        is_flat = false;
    }
    if (is_flat) return std::nullopt;
    return mray::smooth_surface(flat, places[0], places[1], places[2], normals[0], normals[1],
                                normals[2], hit.u, hit.v);
}

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
/// nor between that point and the triangle. `samples` have normal_ids. Returns the number of rays.
std::uint64_t light_smooth_surfaces(SceneImpl& scene, const mray::Watch& watch,
                                    const mray::cpu::LitSamples& samples,
                                    std::span<std::uint32_t> shadows) {
    // A shadow whose smooth surface sees the light.
    constexpr std::uint32_t kSeesLight = 2;
    const mray::ImageParams& params = samples.params;
    SampleRays rays(scene, watch, params);
    const mray::cpu::LitShader shader(scene.target());
    /// Adds ray_of(flat, above) for a sample, if a smooth surface is above it.
    const auto add_ray = [&](std::uint32_t x, std::uint32_t y, SampleBatch& batch, auto ray_of) {
        const std::size_t sample = std::size_t{y} * params.width + x;
        const mray::Hit& hit = samples.hits[sample];
        const mray::Surface flat = rays.surface(x, y, hit);
        const std::optional<mray::Surface> above = surface_above(samples, flat, hit);
        if (above) batch.add(ray_of(flat, *above), sample);
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

// ---- Lit images and false colours

/// A colour from dark blue over green to dark red (after A. Mikhailov. Turbo, an improved rainbow
/// colormap for visualization. 2019), in proportion to the logarithm of n: from 2^first to 2^last.
std::uint32_t heat_colour(std::uint32_t n, std::uint32_t first, std::uint32_t last) {
    // Red, green and blue at equal distances.
    static constexpr std::int32_t kStops[][3] = {{48, 18, 59},   {70, 134, 251}, {27, 229, 181},
                                                 {164, 252, 60}, {251, 185, 56}, {226, 66, 10},
                                                 {122, 4, 3}};
    constexpr std::int32_t kParts = std::size(kStops) - 1;
    // The logarithm in units of 2^-8, linear between powers of two.
    const std::uint32_t from = std::clamp(n, 1u << first, 1u << last);
    const auto power = static_cast<std::uint32_t>(std::bit_width(from)) - 1;
    const auto fraction = static_cast<std::uint32_t>((std::uint64_t{from} << 8 >> power) & 255);
    const auto range = static_cast<std::int32_t>((last - first) << 8);
    const auto along = static_cast<std::int32_t>(((power - first) << 8) + fraction) * kParts;
    const std::int32_t part = std::min(along / range, kParts - 1);
    const std::int32_t rest = along - part * range;
    std::uint32_t channels[3];
    for (int k = 0; k < 3; ++k) {
        const std::int32_t a = kStops[part][k];
        const std::int32_t b = kStops[part + 1][k];
        channels[k] = static_cast<std::uint32_t>(a + (b - a) * rest / range);
    }
    return mray::pack_rgb(channels[0], channels[1], channels[2]);
}

/// Colours the samples by what the tree costs there; black without a hit, but for steps.
void colour_by_tree(SceneImpl& scene, Shading shading, const mray::Watch& watch,
                    TracedImage& image) {
    const mray::Bvh& tree = scene.tracer().host_tree();
    const bool is_steps = shading == Shading::steps;
    const std::vector<float> looseness =
        is_steps ? std::vector<float>() : mray::cpu::leaf_looseness(tree);
    const std::uint32_t width = image.params.width;
    const auto colour = [&](std::uint32_t x, std::uint32_t y, const mray::Hit& hit) {
        if (is_steps) {
            const mray::Ray ray = mray::camera_ray(image.params.camera, x, y);
            return heat_colour(mray::cpu::count_steps(tree, ray, hit), 0, 6);
        }
        if (hit.prim_id == mray::kNoPrim) return 0xFF000000u;
        // Loosenesses from 1 to 16 differ.
        const float loose = std::min(looseness[hit.prim_id], 1024.0f);
        return heat_colour(static_cast<std::uint32_t>(loose * 16.0f), 4, 8);
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

/// Traces and shades a view in the CPU's shader.
void render_lit(SceneImpl& scene, const View& view, const mray::Watch& watch, TracedImage& traced,
                Image& image) {
    const MeshList& meshes = scene.meshes();
    const PoseReader& pose = scene.pose();
    mray::Backend& backend = scene.tracer();
    if (view.shading < Shading::plain || view.shading > Shading::sah)
        throw_bad_argument(
            "View::shading: not one of plain, lit, normal, depth, prim, steps and sah");
    const bool is_of_tree = view.shading > Shading::prim;
    const LitKind kind = is_of_tree ? LitKind::kPlain : static_cast<LitKind>(view.shading);
    const bool is_lit = kind == LitKind::kLit;
    const bool is_smooth = (is_lit || kind == LitKind::kNormal) && !view.flat;
    const std::uint32_t side = sample_side(view.samples);
    if (side * side != view.samples)
        throw_bad_argument("View::samples: {}, which is not one of 1, 4, 16 and 64", view.samples);
    mray::ViewSpec spec = engine::to_spec(view, scene.options().origin);
    // More than this is refused.
    constexpr std::uint32_t kMostPixels = 1u << 20;
    spec.width = std::min(view.width, kMostPixels) * side;
    spec.height = std::min(view.height, kMostPixels) * side;
    if (auto& pinhole = spec.pinhole)
        for (double* const pixels : {&pinhole->fx, &pinhole->fy, &pinhole->cx, &pinhole->cy})
            *pixels *= side;
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
    const mray::VertexNormals* const normals = has_smooth ? &scene.normals() : nullptr;
    if (is_of_tree) colour_by_tree(scene, view.shading, watch, traced);
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
        .normal_ids = has_smooth ? normals->ids() : std::span<const mray::uvec3>(),
        .normals = has_smooth ? normals->normals() : std::span<const mray::vec3>(),
        .textures = meshes.textures(),
        .hits = traced.samples.hits,
        .shadows = traced.samples.occlusion,
        .occlusion = traced.sky.occlusion,
        .ao_count = traced.has_sky ? view.ao_count : 0,
        .colours = traced.samples.pixels};
    if (is_lit) {
        if (has_smooth)
            image.ray_count +=
                light_smooth_surfaces(scene, watch, samples, traced.samples.occlusion);
        image.trace_ms += stopwatch.ms();
        stopwatch = mray::Stopwatch();
    }
    image.pixels.resize(std::size_t{view.width} * view.height);
    static_assert(sizeof(LitPixel) == sizeof(mray::cpu::LitPixel));
    image.lit_pixels.resize(is_lit && view.lit_pixels ? image.pixels.size() : 0);
    const mray::cpu::LitShader shader(scene.target());
    // Rows of samples in a band, of which few are shared with its neighbours.
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
            shader.shade_rows(samples, begin, std::min(begin + band, view.height),
                              image.pixels.data() + first, details);
        });
    });
    image.shade_ms = stopwatch.ms();
    image.trace_ms += image.shade_ms;
}

/// Fills hits, occlusion and both hashes of an image whose pixels are there.
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

// ---- Stacks

/// Makes the channels of a stack. Threads may share it.
class StackChannels {
public:
    StackChannels(const SceneImpl& scene, const mray::ViewBatch& views, const ImageStack& stack)
        : scene_(scene), views_(views), stack_(stack) {}

    std::uint32_t hit_words() const {
        return (has_depths_ ? mray::kHitT : 0u) | (has_triangles_ ? mray::kHitPrim : 0u) |
               (stack_.uv.empty() ? 0u : mray::kHitU | mray::kHitV);
    }

    void fill(const mray::TracedTile& tile) const {
        const auto [width, height] = std::pair(views_.params.width, views_.params.height);
        const std::size_t columns = tile.x1 - tile.x0;
        for (std::uint32_t y = tile.y0; y < tile.y1; ++y) {
            const std::size_t from = (y - tile.y0) * tile.stride;
            const std::size_t to = (tile.view * height + y) * width + tile.x0;
            if (views_.with_pixels) std::copy_n(tile.pixels + from, columns, &stack_.shaded[to]);
            if (has_depths_) fill_depths(tile, y, from, to);
            if (has_triangles_) fill_triangles(tile, from, to);
            if (stack_.uv.empty()) continue;
            const HitColumn<float> u(tile, mray::kHitU, from), v(tile, mray::kHitV, from);
            for (std::size_t i = 0; i < columns; ++i) stack_.uv[to + i] = {u[i], v[i]};
        }
    }

private:
    /// A word of the hits of a tile, from pixel `first` on.
    template <class T>
    class HitColumn {
    public:
        HitColumn(const mray::TracedTile& tile, mray::HitWords word, std::size_t first)
            : step_(sizeof(T) * static_cast<std::size_t>(std::popcount(tile.hit_words))),
              words_(static_cast<const std::byte*>(tile.hits) + first * step_ +
                     sizeof(T) *
                         static_cast<std::size_t>(std::popcount(tile.hit_words & (word - 1u)))) {}
        const T& operator[](std::size_t i) const {
            return *reinterpret_cast<const T*>(words_ + i * step_);
        }

    private:
        std::size_t step_;
        const std::byte* words_;
    };

    void fill_depths(const mray::TracedTile& tile, std::uint32_t y, std::size_t from,
                     std::size_t to) const {
        // A copy: stores of floats could change what it refers to.
        const mray::Camera camera = views_.cameras[tile.view];
        const mray::SceneSpace space = scene_.pose().space();
        const HitColumn<float> ts(tile, mray::kHitT, from);
        const HitColumn<std::uint32_t> prims(tile, mray::kHitPrim, from);
        const bool has_prims = (tile.hit_words & mray::kHitPrim) != 0;
        for (std::uint32_t x = tile.x0; x < tile.x1; ++x, ++to) {
            const std::size_t i = x - tile.x0;
            float depth = std::numeric_limits<float>::infinity();
            if (has_prims ? prims[i] != mray::kNoPrim : ts[i] < depth)
                depth = mray::world_depth(camera, space, ts[i], x, y);
            if (!stack_.depth.empty()) stack_.depth[to] = depth;
            if (!stack_.distance.empty()) {
                const mray::dvec3 dir(mray::camera_direction(camera, x, y));
                stack_.distance[to] = static_cast<float>(depth * std::sqrt(glm::dot(dir, dir)));
            }
        }
    }

    void fill_triangles(const mray::TracedTile& tile, std::size_t from, std::size_t to) const {
        const HitColumn<std::uint32_t> prims(tile, mray::kHitPrim, from);
        // Neighbours are often of one mesh.
        std::uint32_t first = 0, count = 0, geom_id = kNoGeometry;
        for (std::size_t i = 0; i < tile.x1 - tile.x0; ++i, ++to) {
            const std::uint32_t prim = prims[i];
            const bool is_hit = prim != mray::kNoPrim;
            if (is_hit && prim - first >= count) {
                geom_id = scene_.meshes().locate(0, 0, 0, prim).geom_id;
                first = scene_.meshes().slots()[geom_id].first_prim;
                count = scene_.meshes().slots()[geom_id].prim_count;
            }
            if (!stack_.geom_id.empty()) stack_.geom_id[to] = is_hit ? geom_id : kNoGeometry;
            if (!stack_.prim_id.empty()) stack_.prim_id[to] = is_hit ? prim - first : kNoPrim;
            if (stack_.normal.empty()) continue;
            const mray::vec3 normal = is_hit ? flat_normal(scene_, prim) : mray::vec3(0, 0, 0);
            stack_.normal[to] = {normal.x, normal.y, normal.z};
        }
    }

    const SceneImpl& scene_;
    const mray::ViewBatch& views_;
    const ImageStack& stack_;
    bool has_depths_ = !stack_.depth.empty() || !stack_.distance.empty();
    bool has_triangles_ =
        !stack_.geom_id.empty() || !stack_.prim_id.empty() || !stack_.normal.empty();
};

/// Throws Error unless the views are of one size and kind, and each array has that size or none.
void check_stack(std::span<const View> views, const ImageStack& stack) {
    for (const View& view : views) {
        const View& first = views.front();
        if (view.width != first.width || view.height != first.height)
            throw_bad_argument("views of {} x {} and of {} x {} pixels; a stack has one size",
                               first.width, first.height, view.width, view.height);
        if (view.shading != Shading::plain || view.rays != Rays::primary || view.samples != 1)
            throw_bad_argument(
                "a stack is of views with Shading::plain, Rays::primary and one sample");
    }
    const std::size_t pixels =
        views.empty() ? 0 : views.size() * views.front().width * views.front().height;
    for (const std::size_t size :
         {stack.depth.size(), stack.distance.size(), stack.geom_id.size(), stack.prim_id.size(),
          stack.normal.size(), stack.uv.size(), stack.shaded.size()}) {
        if (size != 0 && size != pixels)
            throw_bad_argument("an array of ImageStack has {} elements for {} pixels", size,
                               pixels);
    }
}

}  // namespace

void render(SceneImpl& scene, std::span<const View> views, ImageStack& stack) {
    check_stack(views, stack);
    stack.ray_count = 0;
    stack.trace_ms = 0;
    std::vector<mray::Camera> cameras;
    mray::ViewBatch batch;
    for (const View& view : views) {
        batch.params = mray::make_image_params(engine::to_spec(view, scene.options().origin),
                                               scene.pose().bounds(), scene.pose().space());
        cameras.push_back(batch.params.camera);
    }
    batch.cameras = cameras;
    batch.with_pixels = !stack.shaded.empty();
    const StackChannels channels(scene, batch, stack);
    batch.hit_words = channels.hit_words();
    if (batch.hit_words == 0 && !batch.with_pixels) return;
    batch.take = [&](std::span<const mray::TracedTile> tiles) {
        if (tiles.size() == 1) return channels.fill(tiles.front());
        scene.arena().execute([&] {
            tbb::parallel_for(std::size_t{0}, tiles.size(),
                              [&](std::size_t i) { channels.fill(tiles[i]); });
        });
    };
    const std::scoped_lock lock(scene.mutex());
    scene.tracer().watch_images(mray::Watch(views.front().cancel, views.front().progress));
    scene.tracer().trace_views(batch);
    stack.ray_count = scene.tracer().finish().rays;
    stack.trace_ms = scene.tracer().finish().trace_ms;
    scene.cost.add_image(stack.trace_ms, stack.ray_count);
}

void render(SceneImpl& scene, const View& view, Image& image) {
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

}  // namespace morphray::detail
