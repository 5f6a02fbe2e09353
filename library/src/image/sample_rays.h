// Rays that the samples of a traced image are given after it, and that pass through holes.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/backend.h"
#include "common/base/errors.h"
#include "common/base/thread_arena.h"
#include "common/interop/ray.h"
#include "common/scene_queries.h"
#include "cpu/image/pixel_shader.h"
#include "cpu/image/texture.h"

namespace morphray::detail {

/// The scene of a traced image. It must outlive its use.
struct TracedScene {
    mray::cpu::ShadedMesh mesh;
    /// Empty if no texture makes holes.
    mray::cpu::TexturedTriangles textures;
    /// It has a tree of the scene.
    mray::Backend& backend;
    mray::ThreadArena& arena;
    /// As View::cancel.
    const std::atomic<bool>* cancel = nullptr;
};

/// Rays of samples, which may have several.
struct RayBatch {
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
    void append(const RayBatch& other);
};

/// Makes batches of the rays of an image's samples and answers them. Not thread-safe.
class SampleRays {
public:
    explicit SampleRays(const TracedScene& scene) : scene_(scene) {}

    /// Calls ask(y, batch) for each of `height` rows of `width` samples, in many threads, which
    /// adds up to `most` rays a sample, and answer(batch) with the rays of some rows at a time,
    /// from the top down. Throws Error(kCancelled).
    template <class Ask, class Answer>
    void in_batches(std::uint32_t width, std::uint32_t height, std::size_t most, const Ask& ask,
                    const Answer& answer) {
        const auto band = static_cast<std::uint32_t>(
            std::clamp<std::size_t>(kMostRays / (width * most), 1, height));
        std::vector<RayBatch> rows(band);
        RayBatch batch;
        for (std::uint32_t begin = 0; begin < height; begin += band) {
            if (scene_.cancel != nullptr && scene_.cancel->load(std::memory_order_relaxed))
                throw mray::Error(mray::ErrorKind::kCancelled, "the image was cancelled");
            const std::uint32_t count = std::min(band, height - begin);
            scene_.arena.execute([&] {
                tbb::parallel_for(std::uint32_t{0}, count, [&](std::uint32_t i) {
                    rows[i].clear();
                    ask(begin + i, rows[i]);
                });
            });
            batch.clear();
            for (std::uint32_t i = 0; i < count; ++i) batch.append(rows[i]);
            if (!batch.rays.empty()) answer(std::as_const(batch));
        }
    }

    /// The closest hits of rays that are in no hole; valid until the next call.
    std::span<const mray::Hit> trace(const RayBatch& batch);

    /// For each ray 1 if it hits anything that is in no hole, else 0; valid until the next call.
    std::span<const std::uint8_t> occluded(const RayBatch& batch);

    /// Replaces each hit of a ray that is in a hole by the next one of its ray that is not.
    void follow(const RayBatch& batch, std::span<mray::Hit> hits);

    /// The number of rays that were traced.
    std::uint64_t ray_count() const { return ray_count_; }

private:
    // Rays in a batch: 8 MiB of them.
    static constexpr std::size_t kMostRays = std::size_t{1} << 18;

    void find_next(std::span<const mray::Ray> rays, std::span<const mray::HitCursor> after,
                   std::span<mray::Hit> next);

    const TracedScene& scene_;
    std::vector<mray::Hit> hits_;
    std::vector<std::uint8_t> occluded_;
    std::uint64_t ray_count_ = 0;
};

}  // namespace morphray::detail
