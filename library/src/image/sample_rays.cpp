// Rays that the samples of a lit image are given after it was traced.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "common/interop/camera.h"
#include "common/interop/lit.h"
#include "common/interop/surface.h"
#include "common/scene/vertex_normals.h"
#include "cpu/image/pixel_shader.h"
#include "cpu/image/texture.h"
#include "library/src/scene_impl.h"

namespace morphray::detail {
namespace {

// Rays in a batch: 8 MiB of them.
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
        if (scene.meshes.has_alpha_test()) textures_ = scene.meshes.textures();
    }

    /// Calls ask(y, batch) for each row of samples, in many threads, which adds up to `most` rays a
    /// sample, and answer(batch) with the rays of some rows at a time, from the top down.
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
        return mray::cpu::ShadedMesh{&scene_.meshes.topology(), scene_.pose.positions()}.surface(
            mray::camera_ray(params_.camera, x, y), hit);
    }
    bool is_in_hole(const mray::Hit& hit) const {
        return mray::cpu::fails_alpha_test(textures_, hit);
    }

    /// For each ray 1 if it hits anything that is in no hole, else 0; valid until the next call.
    std::span<const std::uint8_t> occluded(std::span<const mray::Ray> rays) {
        occluded_.resize(rays.size());
        ray_count_ += rays.size();
        if (textures_.textures.empty()) {
            scene_.tracer->trace({rays, {}, occluded_});
            return occluded_;
        }
        std::vector<mray::Hit> hits(rays.size());
        scene_.tracer->trace({rays, hits});
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
        // Rays that a thread takes at once. A device takes one call at a time.
        const std::size_t grain =
            scene_.tracer->info().answers_threads ? 256 : std::max<std::size_t>(hits.size(), 1);
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
            scene_.tracer->query(mray::NextQuery{rays, after, mray::Crossing::kEach, next});
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

}  // namespace

std::uint64_t apply_alpha_test(SceneImpl& scene, const mray::Watch& watch, TracedImage& image) {
    const mray::ImageParams& params = image.params;
    const std::span<mray::Hit> hits = image.samples.hits;
    SampleRays rays(scene, watch, params);
    /// For each sample, whether its camera ray passed a hole.
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
    // A sample without occluded rays and without a change of its surface has none.
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
                    if (mray::faces_light(surface, params.light)) {
                        batch.add(mray::shadow_ray(surface, params.light), sample);
                    } else {
                        shadows[sample] = 1;
                    }
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

std::uint64_t light_smooth_surfaces(SceneImpl& scene, const mray::Watch& watch,
                                    const mray::cpu::LitSamples& samples,
                                    std::span<std::uint32_t> shadows) {
    // A shadow whose smooth surface sees the light.
    constexpr std::uint32_t kSeesLight = 2;
    const mray::ImageParams& params = samples.params;
    SampleRays rays(scene, watch, params);
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
        scene.shader.find_flat_shadows(samples, y, xs);
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

}  // namespace morphray::detail
