#include "library/image/holes.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>

#include "common/base/errors.h"
#include "common/interop/camera.h"
#include "common/interop/surface.h"
#include "common/ray_queries.h"
#include "common/scene_queries.h"

namespace morphray::detail {
namespace {

// Rays in a batch: 8 MiB of them.
constexpr std::size_t kMostRays = std::size_t{1} << 18;
// Rays that a thread takes at once.
constexpr std::size_t kGrain = 256;

/// Rays of samples, which may have several.
struct Batch {
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
    void append(const Batch& other) {
        rays.insert(rays.end(), other.rays.begin(), other.rays.end());
        samples.insert(samples.end(), other.samples.begin(), other.samples.end());
    }
};

class HolePass {
public:
    HolePass(const HoledScene& scene, TracedImage& image)
        : scene_(scene),
          image_(image),
          params_(image.params),
          is_changed_(image.samples.hits.size()) {}

    std::uint64_t run() {
        follow_camera_rays();
        if (params_.rays == mray::kRaysShadow) {
            count_again(
                image_.samples.occlusion, 1,
                [&](const mray::Surface& surface, std::uint32_t, std::uint32_t, std::size_t sample,
                    Batch& batch) { batch.add(mray::shadow_ray(surface, params_.light), sample); });
        }
        if (image_.has_sky) {
            count_again(image_.sky.occlusion, params_.ao_count,
                        [&](const mray::Surface& surface, std::uint32_t x, std::uint32_t y,
                            std::size_t sample, Batch& batch) {
                            for (std::uint32_t k = 0; k < params_.ao_count; ++k)
                                batch.add(mray::ao_ray(surface, x, y, k, params_.ao_tfar), sample);
                        });
        }
        return ray_count_;
    }

private:
    bool is_hit(std::size_t sample) const {
        return image_.samples.hits[sample].prim_id != mray::kNoPrim;
    }

    /// Calls work(begin, end) for parts of [0, count), on all threads.
    template <class Work>
    void in_parts(std::size_t count, const Work& work) {
        using Range = tbb::blocked_range<std::size_t>;
        scene_.arena.execute([&] {
            tbb::parallel_for(Range(0, count, kGrain),
                              [&](const Range& r) { work(r.begin(), r.end()); });
        });
    }

    /// Calls ask(y, batch), which adds up to `most` rays for each sample of row y, for bands of
    /// rows from the top down, and then answer() with the rays of each band in batch_.
    template <class Ask, class Answer>
    void for_bands(std::size_t most, const Ask& ask, const Answer& answer) {
        const std::size_t row_rays = std::size_t{params_.width} * most;
        const auto band = static_cast<std::uint32_t>(
            std::clamp<std::size_t>(kMostRays / row_rays, 1, params_.height));
        std::vector<Batch> rows(band);
        for (std::uint32_t begin = 0; begin < params_.height; begin += band) {
            if (scene_.cancel != nullptr && scene_.cancel->load(std::memory_order_relaxed))
                throw mray::Error(mray::ErrorKind::kCancelled, "the image was cancelled");
            const std::uint32_t count = std::min(band, params_.height - begin);
            scene_.arena.execute([&] {
                tbb::parallel_for(std::uint32_t{0}, count, [&](std::uint32_t i) {
                    rows[i].clear();
                    ask(begin + i, rows[i]);
                });
            });
            batch_.clear();
            for (std::uint32_t i = 0; i < count; ++i) batch_.append(rows[i]);
            if (!batch_.rays.empty()) answer();
        }
    }

    void follow_camera_rays() {
        const auto ask = [&](std::uint32_t y, Batch& batch) {
            for (std::uint32_t x = 0; x < params_.width; ++x) {
                const std::size_t sample = std::size_t{y} * params_.width + x;
                if (mray::cpu::is_hole(scene_.textures, image_.samples.hits[sample]))
                    batch.add(mray::camera_ray(params_.camera, x, y), sample);
            }
        };
        for_bands(1, ask, [&] {
            hits_.clear();
            for (const std::size_t sample : batch_.samples)
                hits_.push_back(image_.samples.hits[sample]);
            follow();
            for (std::size_t i = 0; i < hits_.size(); ++i) {
                image_.samples.hits[batch_.samples[i]] = hits_[i];
                is_changed_[batch_.samples[i]] = 1;
            }
        });
    }

    /// Counts the rays of samples that are occluded. Without a change of its surface a sample that
    /// has none has none. Surfaces that face away from the light have one shadow ray that is.
    template <class AddRays>
    void count_again(std::vector<std::uint32_t>& occluded, std::uint32_t most,
                     const AddRays& add_rays) {
        const bool is_shadow = &occluded == &image_.samples.occlusion;
        const auto ask = [&](std::uint32_t y, Batch& batch) {
            for (std::uint32_t x = 0; x < params_.width; ++x) {
                const std::size_t sample = std::size_t{y} * params_.width + x;
                if (is_changed_[sample] == 0 && occluded[sample] == 0) continue;
                occluded[sample] = 0;
                if (!is_hit(sample)) continue;
                const mray::Surface surface = scene_.mesh.surface(
                    mray::camera_ray(params_.camera, x, y), image_.samples.hits[sample]);
                if (is_shadow && !mray::faces_light(surface, params_.light)) {
                    occluded[sample] = 1;
                } else {
                    add_rays(surface, x, y, sample, batch);
                }
            }
        };
        for_bands(most, ask, [&] {
            hits_.resize(batch_.rays.size());
            scene_.backend.trace_rays(batch_.rays, hits_);
            ray_count_ += hits_.size();
            follow();
            for (std::size_t i = 0; i < hits_.size(); ++i) {
                if (hits_[i].prim_id != mray::kNoPrim) ++occluded[batch_.samples[i]];
            }
        });
    }

    /// Replaces each of hits_ that is in a hole by the next one of its ray in batch_ that is not.
    void follow() {
        std::vector<std::size_t> open(hits_.size());
        for (std::size_t i = 0; i < open.size(); ++i) open[i] = i;
        std::vector<std::uint8_t> is_open;
        std::vector<mray::Ray> rays;
        std::vector<mray::HitCursor> after;
        std::vector<mray::Hit> next;
        while (true) {
            is_open.resize(open.size());
            in_parts(open.size(), [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    is_open[i] = mray::cpu::is_hole(scene_.textures, hits_[open[i]]) ? 1 : 0;
            });
            std::size_t kept = 0;
            rays.clear();
            after.clear();
            for (std::size_t i = 0; i < open.size(); ++i) {
                if (is_open[i] == 0) continue;
                const mray::Hit& hit = hits_[open[i]];
                rays.push_back(batch_.rays[open[i]]);
                after.push_back({hit.t, hit.prim_id});
                open[kept++] = open[i];
            }
            open.resize(kept);
            if (open.empty()) return;
            next.resize(kept);
            find_next(rays, after, next);
            for (std::size_t i = 0; i < kept; ++i) hits_[open[i]] = next[i];
        }
    }

    void find_next(std::span<const mray::Ray> rays, std::span<const mray::HitCursor> after,
                   std::span<mray::Hit> next) {
        const mray::SceneQueries& queries = scene_.backend.scene_queries();
        ray_count_ += rays.size();
        const auto find = [&](std::size_t begin, std::size_t end) {
            queries.intersect_after(rays.subspan(begin, end - begin),
                                    after.subspan(begin, end - begin), mray::Crossing::kEach,
                                    next.subspan(begin, end - begin));
        };
        // A device takes one call at a time.
        if (scene_.backend.queries() == nullptr) return find(0, rays.size());
        in_parts(rays.size(), find);
    }

    const HoledScene& scene_;
    TracedImage& image_;
    const mray::ImageParams& params_;
    /// For each sample, whether its camera ray passed a hole.
    std::vector<std::uint8_t> is_changed_;
    Batch batch_;
    std::vector<mray::Hit> hits_;
    std::uint64_t ray_count_ = 0;
};

}  // namespace

std::uint64_t pass_holes(const HoledScene& scene, TracedImage& image) {
    return HolePass(scene, image).run();
}

}  // namespace morphray::detail
