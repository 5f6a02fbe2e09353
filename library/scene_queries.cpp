// The const members of SceneImpl: queries.
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

#include "common/base/stopwatch.h"
#include "common/bvh/bvh_stats.h"
#include "common/bvh/tree_boxes.h"
#include "library/errors.h"
#include "library/image/image_conversion.h"
#include "library/ray_grid.h"
#include "library/scene_impl.h"

namespace morphray::detail {
namespace {

// Batches up to this size are traced in the calling thread; waking other threads takes longer.
constexpr std::size_t kFewRays = 256;
// Rays that are converted and traced together, in memory on the stack.
constexpr std::size_t kRun = mray::cpu::SceneRays::kMost;
// Rays that are handed to a device together.
constexpr std::size_t kDeviceBatch = std::size_t{1} << 18;

// The most samples of an image whose memory is kept for the next image: 340 MB with those of the
// sky.
constexpr std::size_t kMostSpareSamples = std::size_t{1} << 23;

// The answers of a tile's rays are prefetched this many rows ahead: processors do not foresee where
// a row begins (docs/lab/cpu_tracer.md).
constexpr std::size_t kRowsAhead = 2;

/// Prefetches memory that will be written soon.
template <class T>
void prefetch_for_writing(std::span<T> memory) {
    constexpr std::size_t kCacheLine = 64;
    const std::span<std::byte> bytes = std::as_writable_bytes(memory);
    for (std::size_t at = 0; at < bytes.size(); at += kCacheLine) __builtin_prefetch(&bytes[at], 1);
}

/// Lets a backend's images be cancelled while it lives.
class Cancellable {
public:
    Cancellable(mray::Backend& backend, const std::atomic<bool>* cancel) : backend_(backend) {
        backend_.cancel_images(cancel);
    }
    ~Cancellable() { backend_.cancel_images(nullptr); }
    Cancellable(const Cancellable&) = delete;
    Cancellable& operator=(const Cancellable&) = delete;

private:
    mray::Backend& backend_;
};

/// A ray in scene space that hits nothing: its interval is empty.
constexpr mray::Ray kNoRay = {.org = {0, 0, 0}, .tnear = 1, .dir = {0, 0, 1}, .tfar = 0};

/// Calls `work(first, count)` for runs of at most kRun of `total` rays, in this thread or in many.
template <class Work>
void for_each_run(std::size_t total, mray::ThreadArena& arena, Work work) {
    const auto run_range = [&](std::size_t first, std::size_t end) {
        for (; first < end; first += kRun) work(first, std::min(kRun, end - first));
    };
    if (total <= kFewRays) {
        run_range(0, total);
        return;
    }
    using Range = tbb::blocked_range<std::size_t>;
    arena.execute([&] {
        tbb::parallel_for(Range(0, total, kRun),
                          [&](const Range& range) { run_range(range.begin(), range.end()); });
    });
}

}  // namespace

/// Returns the milliseconds that the device traced.
double SceneImpl::trace_on_device(std::span<const mray::Ray> rays,
                                  std::span<mray::Hit> hits) const {
    const std::scoped_lock lock(mutex_);
    tracer_->trace_rays(rays, hits);
    return tracer_->times().trace_ms;
}

/// Converts in many threads, and traces in large batches. Returns the milliseconds of tracing; they
/// leave out what the tree has no part in, such as waiting for other threads and compiling kernels.
double SceneImpl::intersect_on_device(std::span<const Ray> rays, std::span<Hit> hits) const {
    std::vector<mray::Ray> batch;
    std::vector<int> t_exponents;
    std::vector<mray::Hit> found;
    double trace_ms = 0;
    for (std::size_t begin = 0; begin < rays.size(); begin += kDeviceBatch) {
        const std::size_t size = std::min(kDeviceBatch, rays.size() - begin);
        batch.resize(size);
        t_exponents.resize(size);
        found.resize(size);
        for_each_run(size, arena(), [&](std::size_t first, std::size_t count) {
            mray::cpu::SceneRays scene;
            make_scene_rays(rays.subspan(begin + first, count), scene);
            for (std::size_t i = 0; i < count; ++i) {
                batch[first + i] = scene.rays[i];
                t_exponents[first + i] = scene.t_exponents[2 * i + 1];
            }
        });
        trace_ms += trace_on_device(batch, found);
        for_each_run(size, arena(), [&](std::size_t first, std::size_t count) {
            for (std::size_t i = first; i < first + count; ++i) {
                hits[begin + i] = to_world(found[i], t_exponents[i]);
            }
        });
    }
    return trace_ms;
}

/// Brings at most kRun rays into scene space. Rays that cannot hit anything become kNoRay.
void SceneImpl::make_scene_rays(std::span<const Ray> rays, mray::cpu::SceneRays& out) const {
    static_assert(sizeof(Ray) == sizeof(mray::cpu::StoredRay));
    ray_maker_->make({reinterpret_cast<const mray::cpu::StoredRay*>(rays.data()), rays.size()},
                     out);
    for (std::size_t k = 0; k < out.hard_count; ++k) {
        const std::size_t i = out.hard[k];
        const RayScale scale = converter_->to_scene(rays[i], out.rays[i]);
        if (!scale.is_valid) out.rays[i] = kNoRay;
        out.t_exponents[2 * i + 1] = scale.t_exponent;
    }
}

Hit SceneImpl::to_world(const mray::Hit& hit, int t_exponent) const {
    if (hit.prim_id == kNoPrim) return {};
    return meshes_.locate(to_world_t(hit.t, t_exponent), hit.u, hit.v, hit.prim_id);
}

/// Traces at most kRun rays in this thread.
void SceneImpl::intersect_run(std::span<const Ray> rays, std::span<Hit> hits) const {
    mray::cpu::SceneRays scene;
    std::array<mray::Hit, kRun> found;
    make_scene_rays(rays, scene);
    cpu_->intersect(std::span(scene.rays).first(rays.size()), std::span(found).first(rays.size()));
    for (std::size_t i = 0; i < rays.size(); ++i) {
        hits[i] = to_world(found[i], scene.t_exponents[2 * i + 1]);
    }
}

/// Traces the rays of a tile of an image, which `rays` begins with, in packets, and sets answers[i]
/// to answer_of(i, hit) for each rays[i] of them. Returns false, and sets nothing, if they have no
/// packet.
template <class Answer, class AnswerOf>
bool SceneImpl::trace_tile(std::span<const Ray> rays, std::span<Answer> answers, std::size_t row,
                           std::size_t width, std::size_t height, AnswerOf answer_of) const {
    static_assert(sizeof(Ray) == sizeof(mray::cpu::StoredRay));
    mray::Ray first;
    if (!converter_->to_scene(rays.front(), first).is_valid) return false;
    alignas(64) std::array<mray::Hit, mray::cpu::kCameraSide * mray::cpu::kCameraSide> found;
    const mray::cpu::StoredRayTile tile{reinterpret_cast<const mray::cpu::StoredRay*>(rays.data()),
                                        row, static_cast<std::uint32_t>(width),
                                        static_cast<std::uint32_t>(height), first.org};
    if (!cpu_->intersect_stored(tile, found.data())) return false;
    for (std::size_t y = 0; y < height; ++y) {
        if (y + kRowsAhead < height)
            prefetch_for_writing(answers.subspan((y + kRowsAhead) * row, width));
        for (std::size_t x = 0; x < width; ++x) {
            const std::size_t i = y * row + x;
            answers[i] = answer_of(i, found[y * mray::cpu::kCameraSide + x]);
        }
    }
    return true;
}

/// Traces rays in many threads. If they are those of an image it does so in tiles, and sets
/// answers[i] to answer_of(i, hit) for rays[i]; otherwise, and for what is beside the tiles,
/// run(first, count) is to trace at most kRun of them.
template <class Answer, class AnswerOf, class Run>
void SceneImpl::trace_all(std::span<const Ray> rays, std::span<Answer> answers, AnswerOf answer_of,
                          Run run) const {
    constexpr std::size_t kSide = mray::cpu::kCameraSide;
    constexpr std::size_t kStep = mray::cpu::kStoredTileStep;
    const RayGrid grid = rays.size() > kFewRays ? find_grid(rays) : RayGrid{};
    if (grid.row == 0) {
        for_each_run(rays.size(), arena(), run);
        return;
    }
    const std::size_t width = grid.row / kStep * kStep;
    const std::size_t height = grid.rows / kStep * kStep;
    const std::size_t columns = (width + kSide - 1) / kSide;
    const std::size_t tiles = columns * ((height + kSide - 1) / kSide);
    const auto run_range = [&](std::size_t begin, std::size_t end) {
        for (; begin < end; begin += kRun) run(begin, std::min(kRun, end - begin));
    };
    // Tiles whose rays are not on a grid after all.
    std::atomic<std::size_t> refused = 0;
    const auto trace = [&](std::size_t i) {
        const std::size_t x0 = i % columns * kSide;
        const std::size_t y0 = i / columns * kSide;
        const std::size_t x1 = std::min(x0 + kSide, width);
        const std::size_t y1 = std::min(y0 + kSide, height);
        const std::size_t first = y0 * grid.row + x0;
        constexpr std::size_t kManyRefused = 8;
        if (refused.load(std::memory_order_relaxed) < kManyRefused) {
            const auto from_first = [&](std::size_t k, const mray::Hit& hit) {
                return answer_of(first + k, hit);
            };
            if (trace_tile(rays.subspan(first), answers.subspan(first), grid.row, x1 - x0, y1 - y0,
                           from_first))
                return;
            refused.fetch_add(1, std::memory_order_relaxed);
        }
        for (std::size_t y = y0; y < y1; ++y) run_range(y * grid.row + x0, y * grid.row + x1);
    };
    arena().execute([&] {
        tbb::parallel_for(std::size_t{0}, tiles, trace);
        // Columns and rows beside the tiles.
        tbb::parallel_for(std::size_t{0}, height, [&](std::size_t y) {
            run_range(y * grid.row + width, (y + 1) * grid.row);
        });
        run_range(height * grid.row, rays.size());
    });
}

void SceneImpl::intersect(std::span<const Ray> rays, std::span<Hit> hits) const {
    require_usable();
    if (rays.size() != hits.size())
        throw_bad_argument(fmt::format("{} rays, but room for {} hits", rays.size(), hits.size()));
    if (cpu_ == nullptr) {
        cost_.add(intersect_on_device(rays, hits), rays.size());
        return;
    }
    const mray::Stopwatch watch;
    trace_all(
        rays, hits,
        [&](std::size_t i, const mray::Hit& hit) {
            return to_world(hit, converter_->t_exponent(rays[i].dir));
        },
        [&](std::size_t first, std::size_t count) {
            intersect_run(rays.subspan(first, count), hits.subspan(first, count));
        });
    cost_.add(watch.ms(), rays.size());
}

Hit SceneImpl::intersect(const Ray& ray) const {
    Hit hit;
    if (cpu_ == nullptr) {
        intersect(std::span<const Ray>(&ray, 1), std::span<Hit>(&hit, 1));
        return hit;
    }
    require_usable();
    mray::Ray scene;
    const RayScale scale = converter_->to_scene(ray, scene);
    if (!scale.is_valid) return hit;
    mray::Hit found;
    cost_.sample([&] {
        cpu_->intersect(std::span<const mray::Ray>(&scene, 1), std::span<mray::Hit>(&found, 1));
    });
    return to_world(found, scale.t_exponent);
}

void SceneImpl::occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
    require_usable();
    if (rays.size() != occluded.size()) {
        throw_bad_argument(
            fmt::format("{} rays, but room for {} answers", rays.size(), occluded.size()));
    }
    if (cpu_ == nullptr) {
        // A device has no kernel that ends at the first hit of any ray.
        std::vector<Hit> hits(rays.size());
        intersect(rays, std::span<Hit>(hits));
        for (std::size_t i = 0; i < hits.size(); ++i) occluded[i] = hits[i] ? 1 : 0;
        return;
    }
    const mray::Stopwatch watch;
    // In packets closest hits take less time than any hits of single rays.
    trace_all(
        rays, occluded,
        [](std::size_t, const mray::Hit& hit) -> std::uint8_t {
            return hit.prim_id != mray::kNoPrim ? 1 : 0;
        },
        [&](std::size_t first, std::size_t count) {
            mray::cpu::SceneRays scene;
            make_scene_rays(rays.subspan(first, count), scene);
            cpu_->occluded(std::span(scene.rays).first(count), occluded.subspan(first, count));
        });
    cost_.add(watch.ms(), rays.size());
}

bool SceneImpl::occluded(const Ray& ray) const {
    std::uint8_t found = 0;
    if (cpu_ == nullptr) {
        occluded(std::span<const Ray>(&ray, 1), std::span<std::uint8_t>(&found, 1));
        return found != 0;
    }
    require_usable();
    mray::Ray scene;
    if (!converter_->to_scene(ray, scene).is_valid) return false;
    cost_.sample([&] {
        cpu_->occluded(std::span<const mray::Ray>(&scene, 1), std::span<std::uint8_t>(&found, 1));
    });
    return found != 0;
}

void SceneImpl::render(const View& view, Image& image) const {
    require_usable();
    TracedImage traced;
    {
        const std::scoped_lock lock(mutex_);
        const Cancellable cancellable(*tracer_, view.cancel);
        if (ImageShader::is_needed_for(view)) {
            shader_.render(view, meshes_, pose_, *tracer_, arena(), spare_, image);
        } else {
            render_plain(view, spare_, image);
        }
        std::swap(traced, spare_);
    }
    fill_hits(view.hits, traced, pose_.space(), meshes_, arena(), image);
    image.width = view.width;
    image.height = view.height;
    image.samples = view.samples;
    cost_.add(image.trace_ms, image.ray_count);
    if (traced.samples.hits.size() > kMostSpareSamples) return;
    const std::scoped_lock lock(mutex_);
    spare_ = std::move(traced);
}

void SceneImpl::render_plain(const View& view, TracedImage& traced, Image& image) const {
    traced.params = mray::make_image_params(to_spec(view), pose_.bounds(), pose_.space());
    traced.has_sky = false;
    traced.samples.with_pixels = true;
    tracer_->trace_image(traced.params, traced.samples);
    image.ray_count = tracer_->times().rays;
    image.trace_ms = tracer_->times().trace_ms;
    image.shade_ms = 0;
    image.pixels.swap(traced.samples.pixels);
    image.lit_pixels.clear();
}

TreeStatistics SceneImpl::tree_statistics() const {
    require_usable();
    const std::scoped_lock lock(mutex_);
    const mray::Bvh& tree = updater_->tree();
    const mray::BvhStats stats = mray::bvh_stats(tree);
    return {stats.sah_cost, stats.node_count, stats.leaf_count,
            stats.depth,    stats.bytes,      mray::bvh_hash(tree)};
}

std::vector<Box> SceneImpl::tree_boxes(std::uint32_t depth) const {
    require_usable();
    const std::scoped_lock lock(mutex_);
    const mray::Bvh& tree = updater_->tree();
    std::vector<Box> boxes;
    for (const mray::Box& box : mray::boxes_at_depth(tree, depth)) {
        const mray::vec3 lower = pose_.space().to_world(box.lower);
        const mray::vec3 upper = pose_.space().to_world(box.upper);
        boxes.push_back({{lower.x, lower.y, lower.z}, {upper.x, upper.y, upper.z}});
    }
    return boxes;
}

Box SceneImpl::bounds() const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Box box{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
    for (const mray::vec3 scene : pose_.positions()) {
        if (scene.x == mray::kInvalidCoordinate) continue;
        const mray::vec3 p = pose_.space().to_world(scene);
        for (int axis = 0; axis < 3; ++axis) {
            const auto k = static_cast<std::size_t>(axis);
            box.lower[k] = std::min(box.lower[k], static_cast<double>(p[axis]));
            box.upper[k] = std::max(box.upper[k], static_cast<double>(p[axis]));
        }
    }
    return box;
}

}  // namespace morphray::detail
