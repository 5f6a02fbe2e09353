#include "library/src/image/alpha_test.h"

#include <cstddef>
#include <vector>

#include "common/interop/camera.h"
#include "common/interop/surface.h"

namespace morphray::detail {
namespace {

class HolePass {
public:
    HolePass(const TracedScene& scene, TracedImage& image)
        : scene_(scene),
          image_(image),
          params_(image.params),
          rays_(scene),
          is_changed_(image.samples.hits.size()) {}

    std::uint64_t run() {
        follow_camera_rays();
        if (params_.rays == mray::kRaysShadow) {
            count_again(image_.samples.occlusion, 1,
                        [&](const mray::Surface& surface, std::uint32_t, std::uint32_t,
                            std::size_t sample, RayBatch& batch) {
                            batch.add(mray::shadow_ray(surface, params_.light), sample);
                        });
        }
        if (image_.has_sky) {
            count_again(image_.sky.occlusion, params_.ao_count,
                        [&](const mray::Surface& surface, std::uint32_t x, std::uint32_t y,
                            std::size_t sample, RayBatch& batch) {
                            for (std::uint32_t k = 0; k < params_.ao_count; ++k)
                                batch.add(mray::ao_ray(surface, x, y, k, params_.ao_tfar), sample);
                        });
        }
        return rays_.ray_count();
    }

private:
    bool is_hit(std::size_t sample) const {
        return image_.samples.hits[sample].prim_id != mray::kNoPrim;
    }

    void follow_camera_rays() {
        const auto ask = [&](std::uint32_t y, RayBatch& batch) {
            for (std::uint32_t x = 0; x < params_.width; ++x) {
                const std::size_t sample = std::size_t{y} * params_.width + x;
                if (mray::cpu::fails_alpha_test(scene_.textures, image_.samples.hits[sample]))
                    batch.add(mray::camera_ray(params_.camera, x, y), sample);
            }
        };
        std::vector<mray::Hit> hits;
        rays_.in_batches(params_.width, params_.height, 1, ask, [&](const RayBatch& batch) {
            hits.clear();
            for (const std::size_t sample : batch.samples)
                hits.push_back(image_.samples.hits[sample]);
            rays_.follow(batch, hits);
            for (std::size_t i = 0; i < hits.size(); ++i) {
                image_.samples.hits[batch.samples[i]] = hits[i];
                is_changed_[batch.samples[i]] = 1;
            }
        });
    }

    /// Counts the rays of samples that are occluded. Without a change of its surface a sample that
    /// has none has none. Surfaces that face away from the light have one shadow ray that is.
    template <class AddRays>
    void count_again(std::vector<std::uint32_t>& occluded, std::uint32_t most,
                     const AddRays& add_rays) {
        const bool is_shadow = &occluded == &image_.samples.occlusion;
        const auto ask = [&](std::uint32_t y, RayBatch& batch) {
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
        rays_.in_batches(params_.width, params_.height, most, ask, [&](const RayBatch& batch) {
            const std::span<const std::uint8_t> is_occluded = rays_.occluded(batch);
            for (std::size_t i = 0; i < is_occluded.size(); ++i)
                occluded[batch.samples[i]] += is_occluded[i];
        });
    }

    const TracedScene& scene_;
    TracedImage& image_;
    const mray::ImageParams& params_;
    SampleRays rays_;
    /// For each sample, whether its camera ray passed a hole.
    std::vector<std::uint8_t> is_changed_;
};

}  // namespace

std::uint64_t apply_alpha_test(const TracedScene& scene, TracedImage& image) {
    return HolePass(scene, image).run();
}

}  // namespace morphray::detail
