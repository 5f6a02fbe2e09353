#include "library/src/queries/host_queries.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <new>
#include <utility>

#include "library/src/queries/ray_runs.h"

namespace morphray::detail {
namespace {

// The answers of a tile's rays are prefetched this many rows ahead: processors do not foresee where
// a row begins (lab/notes/cpu_tracer.md).
constexpr std::size_t kRowsAhead = 2;
// Rays that are gathered are prefetched this many ahead.
constexpr std::size_t kRaysAhead = 16;

/// Prefetches memory that will be written soon.
template <class T>
void prefetch_for_writing(std::span<T> memory) {
    constexpr std::size_t kCacheLine = 64;
    const std::span<std::byte> bytes = std::as_writable_bytes(memory);
    for (std::size_t at = 0; at < bytes.size(); at += kCacheLine) __builtin_prefetch(&bytes[at], 1);
}

}  // namespace

/// Traces the rays of a tile of an image, which `rays` begins with, in packets, and sets answers[i]
/// to answer_of(i, hit) for each rays[i] of them. Returns false, and sets nothing, if they have no
/// packet.
template <class Answer, class AnswerOf>
bool HostQueries::trace_tile(std::span<const Ray> rays, std::span<Answer> answers, std::size_t row,
                             std::size_t width, std::size_t height, AnswerOf answer_of) const {
    static_assert(sizeof(Ray) == sizeof(mray::StoredRay));
    mray::Ray first;
    if (!space_.to_scene(rays.front(), first).is_valid) return false;
    alignas(64) std::array<mray::Hit, mray::kStoredTileSide * mray::kStoredTileSide> found;
    const mray::StoredRayTile tile{reinterpret_cast<const mray::StoredRay*>(rays.data()), row,
                                   static_cast<std::uint32_t>(width),
                                   static_cast<std::uint32_t>(height), first.org};
    if (!scene_.intersect_tile(tile, found.data())) return false;
    for (std::size_t y = 0; y < height; ++y) {
        if (y + kRowsAhead < height)
            prefetch_for_writing(answers.subspan((y + kRowsAhead) * row, width));
        for (std::size_t x = 0; x < width; ++x) {
            const std::size_t i = y * row + x;
            answers[i] = answer_of(i, found[y * mray::kStoredTileSide + x]);
        }
    }
    return true;
}

/// Traces rows of an image, as many as have tiles, until `cancel` is true. Returns the number of
/// their rays. Runs in this thread if `arena` is null.
template <class Answer, class AnswerOf, class Run>
std::size_t HostQueries::trace_image(std::span<const Ray> rays, std::span<Answer> answers,
                                     std::size_t row, AnswerOf answer_of, Run run,
                                     mray::ThreadArena* arena,
                                     const std::atomic<bool>* cancel) const {
    constexpr std::size_t kSide = mray::kStoredTileSide;
    constexpr std::size_t kStep = mray::kStoredTileStep;
    const std::size_t width = row / kStep * kStep;
    const std::size_t height = rays.size() / row / kStep * kStep;
    const std::size_t columns = (width + kSide - 1) / kSide;
    const std::size_t tiles = columns * ((height + kSide - 1) / kSide);
    const auto run_range = [&](std::size_t begin, std::size_t end) {
        for_runs_of(begin, end, cancel, [&](std::size_t first, std::size_t count) {
            run(rays.subspan(first, count), answers.subspan(first, count));
        });
    };
    for_each_part(arena, tiles, [&](std::size_t i) {
        if (is_cancelled(cancel)) return;
        const std::size_t x0 = i % columns * kSide;
        const std::size_t y0 = i / columns * kSide;
        const std::size_t x1 = std::min(x0 + kSide, width);
        const std::size_t y1 = std::min(y0 + kSide, height);
        const std::size_t first = y0 * row + x0;
        const auto from_first = [&](std::size_t k, const mray::Hit& hit) {
            return answer_of(first + k, hit);
        };
        if (trace_tile(rays.subspan(first), answers.subspan(first), row, x1 - x0, y1 - y0,
                       from_first))
            return;
        for (std::size_t y = y0; y < y1; ++y) run_range(y * row + x0, y * row + x1);
    });
    // Columns beside the tiles.
    if (width < row) {
        for_each_part(arena, height,
                      [&](std::size_t y) { run_range(y * row + width, (y + 1) * row); });
    }
    return height * row;
}

/// Traces rays in an order in which neighbours are alike, by run(some, answers) as trace_all(),
/// until `cancel` is true. Returns false, and sets nothing, if there is no memory for the order.
template <class Answer, class Run>
bool HostQueries::trace_sorted(std::span<const Ray> rays, std::span<Answer> answers, Run run,
                               mray::ThreadArena* arena, const std::atomic<bool>* cancel) const {
    const mray::cpu::RayCurve curve = curve_of(rays, space_.extent());
    const mray::cpu::RayKeys keys(curve, space_.target());
    std::unique_ptr<RaySorter> sorter;
    try {
        sorter = sorters_.take();
        sorter->make_room(std::min(rays.size(), RaySorter::kMost));
    } catch (const std::bad_alloc&) {
        return false;
    }
    for (std::size_t begin = 0; begin < rays.size() && !is_cancelled(cancel);
         begin += RaySorter::kMost) {
        const std::span part = rays.subspan(begin, std::min(RaySorter::kMost, rays.size() - begin));
        const std::span part_answers = answers.subspan(begin, part.size());
        const std::span<const std::uint32_t> places = sorter->sort(part, keys, arena);
        for_each_part(arena, (part.size() + kRun - 1) / kRun, [&](std::size_t i) {
            if (is_cancelled(cancel)) return;
            std::array<Ray, kRun> some;
            std::array<Answer, kRun> found;
            const std::span here =
                places.subspan(i * kRun, std::min(kRun, places.size() - i * kRun));
            for (std::size_t k = 0; k < here.size(); ++k) {
                __builtin_prefetch(&part[here[std::min(k + kRaysAhead, here.size() - 1)]]);
                some[k] = part[here[k]];
            }
            for (const std::uint32_t place : here) __builtin_prefetch(&part_answers[place], 1);
            run(std::span<const Ray>(some).first(here.size()), std::span(found).first(here.size()));
            for (std::size_t k = 0; k < here.size(); ++k) part_answers[here[k]] = found[k];
        });
    }
    sorters_.keep(std::move(sorter));
    return true;
}

/// Traces rays on these threads. Sets answers[i] to answer_of(i, hit) for the rays[i] of tiles, and
/// has run(some, found) trace at most kRun others at a time. Throws Error(kCancelled).
template <class Answer, class AnswerOf, class Run>
void HostQueries::trace_all(std::span<const Ray> rays, std::span<Answer> answers,
                            AnswerOf answer_of, Run run, Coherence coherence, Threads threads,
                            const std::atomic<bool>* cancel) const {
    mray::ThreadArena* const arena =
        threads == Threads::calling || rays.size() <= kFewRays ? nullptr : &arena_;
    std::size_t done = 0;
    if (is_image(coherence)) {
        done = trace_image(rays, answers, coherence.width, answer_of, run, arena, cancel);
    } else if (is_to_sort(rays, coherence) && trace_sorted(rays, answers, run, arena, cancel)) {
        done = rays.size();
    }
    const std::span rest = rays.subspan(done);
    const std::span rest_answers = answers.subspan(done);
    const auto run_rest = [&](std::size_t first, std::size_t count) {
        run(rest.subspan(first, count), rest_answers.subspan(first, count));
    };
    if (arena == nullptr) {
        for_runs_of(0, rest.size(), cancel, run_rest);
    } else {
        for_each_run(rest.size(), *arena, cancel, run_rest);
    }
    throw_if_cancelled(cancel);
}

/// Traces at most kRun rays in this thread.
void HostQueries::intersect_run(std::span<const Ray> rays, std::span<Hit> hits) const {
    mray::cpu::SceneRays scene;
    std::array<mray::Hit, kRun> found;
    space_.to_scene(rays, scene);
    scene_.intersect(std::span(scene.rays).first(rays.size()), std::span(found).first(rays.size()));
    for (std::size_t i = 0; i < rays.size(); ++i)
        hits[i] = space_.to_world(found[i], scene.t_exponents[2 * i + 1]);
}

/// As intersect_run().
void HostQueries::occlude_run(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
    mray::cpu::SceneRays scene;
    space_.to_scene(rays, scene);
    scene_.occluded(std::span(scene.rays).first(rays.size()), occluded);
}

void HostQueries::intersect(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence,
                            Threads threads, const std::atomic<bool>* cancel) const {
    cost_.measure(rays.size(), [&] {
        trace_all(
            rays, hits,
            [&](std::size_t i, const mray::Hit& hit) {
                return space_.to_world(hit, space_.t_exponent(rays[i].dir));
            },
            [&](std::span<const Ray> some, std::span<Hit> found) { intersect_run(some, found); },
            coherence, threads, cancel);
    });
}

Hit HostQueries::intersect(const Ray& ray) const {
    Hit hit;
    cost_.measure(1, [&] {
        mray::Ray scene;
        const RayScale scale = space_.to_scene(ray, scene);
        if (!scale.is_valid) return;
        mray::Hit found;
        scene_.intersect(std::span<const mray::Ray>(&scene, 1), std::span<mray::Hit>(&found, 1));
        hit = space_.to_world(found, scale.t_exponent);
    });
    return hit;
}

void HostQueries::occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                           Coherence coherence, Threads threads,
                           const std::atomic<bool>* cancel) const {
    cost_.measure(rays.size(), [&] {
        // In packets closest hits take less time than any hits of single rays.
        trace_all(
            rays, occluded,
            [](std::size_t, const mray::Hit& hit) -> std::uint8_t {
                return hit.prim_id != mray::kNoPrim ? 1 : 0;
            },
            [&](std::span<const Ray> some, std::span<std::uint8_t> found) {
                occlude_run(some, found);
            },
            coherence, threads, cancel);
    });
}

bool HostQueries::occluded(const Ray& ray) const {
    std::uint8_t found = 0;
    cost_.measure(1, [&] {
        mray::Ray scene;
        if (!space_.to_scene(ray, scene).is_valid) return;
        scene_.occluded(std::span<const mray::Ray>(&scene, 1), std::span<std::uint8_t>(&found, 1));
    });
    return found != 0;
}

void HostQueries::ask(std::size_t total, const std::atomic<bool>* cancel, const Ask& ask) const {
    cost_.measure(total, [&] {
        const mray::SceneQueries& queries = backend_.scene_queries();
        for_each_run(
            total, arena_, cancel,
            [&](std::size_t first, std::size_t count) { ask(queries, first, count); },
            kQuestionRun);
    });
    throw_if_cancelled(cancel);
}

}  // namespace morphray::detail
