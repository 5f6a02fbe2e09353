#include "library/src/image/sample_rays.h"

#include <tbb/blocked_range.h>

#include "common/ray_queries.h"

namespace morphray::detail {
namespace {

// Rays that a thread takes at once.
constexpr std::size_t kGrain = 256;

/// Calls work(begin, end) for parts of [0, count), on all threads.
template <class Work>
void in_parts(mray::ThreadArena& arena, std::size_t count, const Work& work) {
    using Range = tbb::blocked_range<std::size_t>;
    arena.execute([&] {
        tbb::parallel_for(Range(0, count, kGrain),
                          [&](const Range& r) { work(r.begin(), r.end()); });
    });
}

}  // namespace

void RayBatch::append(const RayBatch& other) {
    rays.insert(rays.end(), other.rays.begin(), other.rays.end());
    samples.insert(samples.end(), other.samples.begin(), other.samples.end());
}

std::span<const mray::Hit> SampleRays::trace(const RayBatch& batch) {
    hits_.resize(batch.rays.size());
    scene_.backend.trace_rays(batch.rays, hits_);
    ray_count_ += hits_.size();
    follow(batch, hits_);
    return hits_;
}

std::span<const std::uint8_t> SampleRays::occluded(const RayBatch& batch) {
    const std::span<const mray::Ray> rays = batch.rays;
    occluded_.resize(rays.size());
    const mray::RayQueries* const queries = scene_.backend.queries();
    if (queries != nullptr && scene_.textures.textures.empty()) {
        in_parts(scene_.arena, rays.size(), [&](std::size_t begin, std::size_t end) {
            queries->occluded(rays.subspan(begin, end - begin),
                              std::span(occluded_).subspan(begin, end - begin));
        });
        ray_count_ += rays.size();
        return occluded_;
    }
    const std::span<const mray::Hit> hits = trace(batch);
    for (std::size_t i = 0; i < hits.size(); ++i)
        occluded_[i] = hits[i].prim_id == mray::kNoPrim ? 0 : 1;
    return occluded_;
}

void SampleRays::follow(const RayBatch& batch, std::span<mray::Hit> hits) {
    if (scene_.textures.textures.empty()) return;
    std::vector<std::size_t> open(hits.size());
    for (std::size_t i = 0; i < open.size(); ++i) open[i] = i;
    std::vector<std::uint8_t> is_open;
    std::vector<mray::Ray> rays;
    std::vector<mray::HitCursor> after;
    std::vector<mray::Hit> next;
    while (true) {
        is_open.resize(open.size());
        in_parts(scene_.arena, open.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                is_open[i] = mray::cpu::fails_alpha_test(scene_.textures, hits[open[i]]) ? 1 : 0;
        });
        std::size_t kept = 0;
        rays.clear();
        after.clear();
        for (std::size_t i = 0; i < open.size(); ++i) {
            if (is_open[i] == 0) continue;
            const mray::Hit& hit = hits[open[i]];
            rays.push_back(batch.rays[open[i]]);
            after.push_back({hit.t, hit.prim_id});
            open[kept++] = open[i];
        }
        open.resize(kept);
        if (open.empty()) return;
        next.resize(kept);
        find_next(rays, after, next);
        for (std::size_t i = 0; i < kept; ++i) hits[open[i]] = next[i];
    }
}

void SampleRays::find_next(std::span<const mray::Ray> rays, std::span<const mray::HitCursor> after,
                           std::span<mray::Hit> next) {
    const mray::SceneQueries& queries = scene_.backend.scene_queries();
    ray_count_ += rays.size();
    const auto find = [&](std::size_t begin, std::size_t end) {
        queries.intersect_after(rays.subspan(begin, end - begin), after.subspan(begin, end - begin),
                                mray::Crossing::kEach, next.subspan(begin, end - begin));
    };
    // A device takes one call at a time.
    if (scene_.backend.queries() == nullptr) return find(0, rays.size());
    in_parts(scene_.arena, rays.size(), find);
}

}  // namespace morphray::detail
