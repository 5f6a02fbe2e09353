#include "library/src/queries/device_queries.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/stopwatch.h"
#include "library/src/queries/ray_order.h"
#include "library/src/queries/ray_runs.h"

namespace morphray::detail {
namespace {

// Rays that are handed to a device together, and where the caller may cancel. A submission cannot
// be interrupted, and software devices trace some hundred thousand rays a second.
constexpr std::size_t kDeviceBatch = std::size_t{1} << 18;
constexpr std::size_t kCancelledBatch = std::size_t{1} << 15;

}  // namespace

/// Returns the milliseconds that the device traced.
double DeviceQueries::trace(std::span<const mray::Ray> rays, std::span<mray::Hit> hits) const {
    const std::scoped_lock lock(mutex_);
    backend_.trace_rays(rays, hits);
    return backend_.finish().trace_ms;
}

/// Converts in many threads, and traces in large batches, sorted if they are to be and that pays.
/// The reported cost is the time of tracing; it leaves out what the tree has no part in, such as
/// waiting for other threads and compiling kernels.
void DeviceQueries::intersect(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence,
                              Threads, const std::atomic<bool>* cancel) const {
    std::vector<mray::Ray> batch;
    std::vector<int> t_exponents;
    std::vector<mray::Hit> found;
    double trace_ms = 0;
    const std::size_t most = cancel == nullptr ? kDeviceBatch : kCancelledBatch;
    std::optional<mray::cpu::RayCurve> curve;
    RaySorter sorter;
    if (prefers_order() && is_to_sort(rays, coherence)) {
        curve = curve_of(rays, space_.extent());
        sorter.make_room(std::min(rays.size(), most));
    }
    for (std::size_t begin = 0; begin < rays.size(); begin += most) {
        throw_if_cancelled(cancel);
        const std::size_t size = std::min(most, rays.size() - begin);
        batch.resize(size);
        t_exponents.resize(size);
        found.resize(size);
        const std::span part = rays.subspan(begin, size);
        std::span<const std::uint32_t> order;
        if (curve) order = sorter.sort(part, mray::cpu::RayKeys(*curve, space_.target()), &arena_);
        for_each_run(size, arena_, nullptr, [&](std::size_t first, std::size_t count) {
            std::array<Ray, kRun> ordered;
            std::span<const Ray> some = part.subspan(first, count);
            if (curve) {
                for (std::size_t i = 0; i < count; ++i) ordered[i] = part[order[first + i]];
                some = std::span(ordered).first(count);
            }
            mray::cpu::SceneRays scene;
            space_.to_scene(some, scene);
            for (std::size_t i = 0; i < count; ++i) {
                batch[first + i] = scene.rays[i];
                t_exponents[first + i] = scene.t_exponents[2 * i + 1];
            }
        });
        trace_ms += trace(batch, found);
        for_each_run(size, arena_, nullptr, [&](std::size_t first, std::size_t count) {
            for (std::size_t i = first; i < first + count; ++i)
                hits[begin + (curve ? order[i] : i)] = space_.to_world(found[i], t_exponents[i]);
        });
    }
    throw_if_cancelled(cancel);
    cost_.add(trace_ms, rays.size());
}

Hit DeviceQueries::intersect(const Ray& ray) const {
    Hit hit;
    intersect(std::span<const Ray>(&ray, 1), std::span<Hit>(&hit, 1), Coherence::none(),
              Threads::all, nullptr);
    return hit;
}

/// By closest hits: a device has no kernel that ends at the first hit of any ray.
void DeviceQueries::occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                             Coherence coherence, Threads threads,
                             const std::atomic<bool>* cancel) const {
    std::vector<Hit> hits(rays.size());
    intersect(rays, std::span<Hit>(hits), coherence, threads, cancel);
    for (std::size_t i = 0; i < hits.size(); ++i) occluded[i] = hits[i] ? 1 : 0;
}

bool DeviceQueries::occluded(const Ray& ray) const { return bool{intersect(ray)}; }

void DeviceQueries::ask(std::size_t total, const std::atomic<bool>* cancel, const Ask& ask) const {
    const mray::Stopwatch watch;
    for (std::size_t first = 0; first < total; first += kMaxBatch) {
        throw_if_cancelled(cancel);
        const std::scoped_lock lock(mutex_);
        ask(backend_.scene_queries(), first, std::min(kMaxBatch, total - first));
    }
    throw_if_cancelled(cancel);
    cost_.add(watch.ms(), total);
}

}  // namespace morphray::detail
