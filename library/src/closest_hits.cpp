// What rays hit: closest hits and any hits. Rays become a RayBatch in scene space, or a tile of an
// image; hits are brought back to world space.
#include "library/src/query_plan.h"

namespace morphray {
namespace {

using namespace detail;

// Answers of a tile are prefetched this many rows ahead, since processors do not do that.
constexpr std::size_t kRowsAhead = 2;
// Rays that are gathered are prefetched this many ahead.
constexpr std::size_t kRaysAhead = 16;
// Rows of fewer rays are not traced as an image.
constexpr std::size_t kLeastWidth = 8;

// An Answer is a Hit, or 1 for a ray that hits anything and 0 for others.
void set_answer(const SceneImpl& scene, const Ray& ray, const mray::Hit& hit, int t_exponent,
                Hit& answer) {
    answer = to_world(scene.meshes(), scene.space(), ray, hit, t_exponent);
}
void set_answer(const SceneImpl&, const Ray&, const mray::Hit& hit, int, std::uint8_t& answer) {
    answer = hit.prim_id != mray::kNoPrim ? 1 : 0;
}

/// Traces at most kRun rays in this thread.
void trace_run(SceneImpl& scene, std::span<const Ray> rays, std::span<Hit> hits) {
    mray::cpu::SceneRays run;
    std::array<mray::Hit, kRun> found;
    scene.space().to_scene(rays, run);
    scene.tracer().trace(
        {std::span(run.rays).first(rays.size()), std::span(found).first(rays.size())});
    for (std::size_t i = 0; i < rays.size(); ++i)
        set_answer(scene, rays[i], found[i], run.t_exponents[2 * i + 1], hits[i]);
}
void trace_run(SceneImpl& scene, std::span<const Ray> rays, std::span<std::uint8_t> occluded) {
    mray::cpu::SceneRays run;
    scene.space().to_scene(rays, run);
    scene.tracer().trace({std::span(run.rays).first(rays.size()), {}, occluded});
}

/// Traces the rays of a tile of an image, which `rays` begins with, in packets: closest hits, which
/// take less time than any hits of single rays. False: they have no packet.
template <class Answer>
bool trace_tile(SceneImpl& scene, std::span<const Ray> rays, std::span<Answer> answers,
                std::size_t row, std::size_t width, std::size_t height) {
    mray::Ray first;
    const std::optional<int> t_exponent = scene.space().to_scene(rays.front(), first);
    if (!t_exponent || is_far(*t_exponent)) return false;
    alignas(64) std::array<mray::Hit, mray::kStoredTileSide * mray::kStoredTileSide> found;
    const mray::StoredRayTile tile{stored(rays).data(), row, static_cast<std::uint32_t>(width),
                                   static_cast<std::uint32_t>(height), first.org};
    if (!scene.tracer().trace_stored(tile, found.data())) return false;
    for (std::size_t y = 0; y < height; ++y) {
        if (y + kRowsAhead < height) {
            const Answer* const ahead = &answers[(y + kRowsAhead) * row];
            for (std::size_t x = 0; x < width; x += 64 / sizeof(Answer))
                __builtin_prefetch(ahead + x, 1);
        }
        for (std::size_t x = 0; x < width; ++x) {
            const std::size_t i = y * row + x;
            set_answer(scene, rays[i], found[y * mray::kStoredTileSide + x],
                       scene.space().t_exponent(rays[i].dir), answers[i]);
        }
    }
    return true;
}

/// Traces rows of an image that have tiles; returns their rays. In this thread without `arena`.
template <class Answer>
std::size_t trace_image(SceneImpl& scene, std::span<const Ray> rays, std::span<Answer> answers,
                        std::size_t row, mray::ThreadArena* arena, mray::Watch watch) {
    constexpr std::size_t kSide = mray::kStoredTileSide;
    constexpr std::size_t kStep = mray::kStoredTileStep;
    const std::size_t width = row / kStep * kStep;
    const std::size_t height = rays.size() / row / kStep * kStep;
    const std::size_t columns = (width + kSide - 1) / kSide;
    const std::size_t tiles = columns * ((height + kSide - 1) / kSide);
    const auto run_range = [&](std::size_t begin, std::size_t end) {
        for_runs_of(begin, end, watch, [&](std::size_t first, std::size_t count) {
            trace_run(scene, rays.subspan(first, count), answers.subspan(first, count));
        });
    };
    for_each_index(arena, tiles, [&](std::size_t i) {
        if (watch.is_cancelled()) return;
        const std::size_t x0 = i % columns * kSide;
        const std::size_t y0 = i / columns * kSide;
        const std::size_t x1 = std::min(x0 + kSide, width);
        const std::size_t y1 = std::min(y0 + kSide, height);
        const std::size_t first = y0 * row + x0;
        if (trace_tile(scene, rays.subspan(first), answers.subspan(first), row, x1 - x0, y1 - y0))
            return;
        for (std::size_t y = y0; y < y1; ++y) run_range(y * row + x0, y * row + x1);
    });
    // Columns beside the tiles.
    if (width < row) {
        for_each_index(arena, height,
                       [&](std::size_t y) { run_range(y * row + width, (y + 1) * row); });
    }
    return height * row;
}

/// The rays [first, first + count) of a part in its order. At most kRun of them are gathered in
/// `room`; in the order given they are where they are.
std::span<const Ray> in_order(std::span<const Ray> part, std::span<const std::uint32_t> order,
                              std::size_t first, std::size_t count, std::array<Ray, kRun>& room) {
    if (order.empty()) return part.subspan(first, count);
    const std::span<const std::uint32_t> places = order.subspan(first, count);
    for (std::size_t i = 0; i < count; ++i) {
        __builtin_prefetch(&part[places[std::min(i + kRaysAhead, count - 1)]]);
        room[i] = part[places[i]];
    }
    return std::span(room).first(count);
}

template <class Answer>
void trace_in_runs(SceneImpl& scene, std::span<const Ray> part,
                   std::span<const std::uint32_t> order, std::span<Answer> answers,
                   mray::ThreadArena* arena, mray::Watch watch) {
    for_each_run(arena, part.size(), watch, [&](std::size_t first, std::size_t count) {
        if (order.empty()) {
            trace_run(scene, part.subspan(first, count), answers.subspan(first, count));
            return;
        }
        std::array<Ray, kRun> room;
        std::array<Answer, kRun> found;
        const std::span<const Ray> rays = in_order(part, order, first, count, room);
        for (std::size_t i = 0; i < count; ++i) __builtin_prefetch(&answers[order[first + i]], 1);
        trace_run(scene, rays, std::span(found).first(count));
        for (std::size_t i = 0; i < count; ++i) answers[order[first + i]] = found[i];
    });
}

/// Answers rays that see everything by large calls, which cannot be interrupted. Rays are converted
/// in many threads. The reported cost leaves out what the tree has no part in, such as waiting for
/// other threads and compiling kernels.
template <class Answer>
void trace_in_large_calls(SceneImpl& scene, std::span<const Ray> rays, std::span<Answer> answers,
                          const QueryOptions& options) {
    constexpr std::size_t kMost = std::size_t{1} << 18;
    // The first one where the caller may cancel: a workgroup.
    constexpr std::size_t kLeast = 64;
    std::vector<mray::Ray> asked;
    std::vector<int> t_exponents;
    std::vector<mray::Hit> hits;
    const auto trace_batch = [&](std::size_t first, auto batch, auto order) {
        const auto trace_part = [&](std::size_t begin, std::size_t size) {
            asked.resize(size);
            t_exponents.resize(size);
            hits.resize(size);
            for_each_run(&scene.arena(), size, {}, [&](std::size_t done, std::size_t count) {
                std::array<Ray, kRun> room;
                mray::cpu::SceneRays run;
                scene.space().to_scene(in_order(batch, order, begin + done, count, room), run);
                for (std::size_t i = 0; i < count; ++i) {
                    asked[done + i] = run.rays[i];
                    t_exponents[done + i] = run.t_exponents[2 * i + 1];
                }
            });
            scene.cost.add(scene.tracer().trace({asked, hits}), size);
            for_each_run(&scene.arena(), size, {}, [&](std::size_t done, std::size_t count) {
                for (std::size_t i = done; i < done + count; ++i) {
                    const std::size_t at = order.empty() ? begin + i : order[begin + i];
                    set_answer(scene, batch[at], hits[i], t_exponents[i], answers[first + at]);
                }
            });
        };
        mray::for_watched_runs(0, batch.size(), mray::Watch(options.cancel), kMost, kLeast,
                               trace_part);
    };
    for_ordered_batches(scene, rays, options, kMost, &scene.arena(), trace_batch);
}

/// Answers rays that see everything.
template <class Answer>
void trace_all(SceneImpl& scene, std::span<const Ray> rays, std::span<Answer> answers,
               const QueryOptions& options) {
    const mray::Watch watch(options.cancel);
    if (scene.tracer().info().call_size > kRun) {
        trace_in_large_calls(scene, rays, answers, options);
        return watch.throw_if_cancelled();
    }
    const bool is_alone = options.threads == Threads::calling || rays.size() <= kFewRays;
    mray::ThreadArena* const arena = is_alone ? nullptr : &scene.arena();
    const Coherence coherence = options.coherence;
    scene.cost.measure(rays.size(), [&] {
        std::size_t done = 0;
        if (coherence.kind == Coherence::Kind::image && coherence.width >= kLeastWidth)
            done = trace_image(scene, rays, answers, coherence.width, arena, watch);
        scene.cost.mark_image(done);
        const auto trace_batch = [&](std::size_t first, auto batch, auto order) {
            trace_in_runs(scene, batch, order, answers.subspan(done + first, batch.size()), arena,
                          watch);
        };
        for_ordered_batches(scene, rays.subspan(done), options, RaySorter::kMost, arena,
                            trace_batch);
        watch.throw_if_cancelled();
    });
}

/// A ray in the calling thread, without the memory of runs.
template <class Answer>
Answer trace_one(SceneImpl& scene, const Ray& ray) {
    Answer answer{};
    scene.cost.measure(1, [&] {
        mray::Ray in_scene;
        const std::optional<int> t_exponent = scene.space().to_scene(ray, in_scene);
        if (!t_exponent) return;
        if constexpr (std::is_same_v<Answer, Hit>) {
            mray::Hit found;
            scene.tracer().trace({{&in_scene, 1}, {&found, 1}});
            set_answer(scene, ray, found, *t_exponent, answer);
        } else {
            scene.tracer().trace({{&in_scene, 1}, {}, {&answer, 1}});
        }
    });
    return answer;
}

/// Replaces hits with triangles that the filter leaves out by the next hits of their rays.
void pass_unseen(SceneImpl& scene, QueryFilter& filter, std::span<const Ray> rays,
                 std::span<Hit> hits) {
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < rays.size(); ++i)
        if (hits[i] && !filter.sees(i, hits[i])) places.push_back(i);
    if (places.empty()) return;
    const auto pass = [&](const RayPart& part) {
        std::vector<mray::Hit> found(part.size());
        const std::vector<mray::HitCursor> start(part.size());
        part.ask(mray::NextQuery{part.rays, start, mray::Crossing::kEach, found});
        for (std::size_t i = 0; i < part.size(); ++i) {
            const std::size_t at = part.numbers[i];
            set_answer(scene, rays[at], found[i], part.t_exponents[i], hits[at]);
        }
    };
    for_parts<RayPart, mray::NextQuery>(
        scene, rays, places.size(), filter, [&](std::size_t i) { return places[i]; }, pass);
}

void find_closest(SceneImpl& scene, std::span<const Ray> rays, std::span<Hit> hits,
                  const QueryOptions& options) {
    QueryFilter filter(scene, rays.size(), "rays", hits.size(), options);
    trace_all(scene, rays, hits, options);
    if (!filter.sees_all()) pass_unseen(scene, filter, rays, hits);
}

}  // namespace

void Scene::intersect(std::span<const Ray> rays, std::span<Hit> hits,
                      const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) { find_closest(scene, rays, hits, options); });
}
Hit Scene::intersect(const Ray& ray) const {
    return with_scene(impl_, [&](SceneImpl& scene) { return trace_one<Hit>(scene, ray); });
}
Hit Scene::intersect(const Ray& ray, const QueryOptions& options) const {
    Hit hit;
    intersect({&ray, 1}, {&hit, 1}, options);
    return hit;
}

void Scene::occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                     const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        if (QueryFilter(scene, rays.size(), "rays", occluded.size(), options).sees_all()) {
            trace_all(scene, rays, occluded, options);
        } else {
            std::vector<Hit> hits(rays.size());
            find_closest(scene, rays, hits, options);
            for (std::size_t i = 0; i < hits.size(); ++i) occluded[i] = hits[i] ? 1 : 0;
        }
    });
}

bool Scene::occluded(const Ray& ray) const {
    return with_scene(impl_,
                      [&](SceneImpl& scene) { return trace_one<std::uint8_t>(scene, ray) != 0; });
}
bool Scene::occluded(const Ray& ray, const QueryOptions& options) const {
    std::uint8_t occluded = 0;
    this->occluded({&ray, 1}, {&occluded, 1}, options);
    return occluded != 0;
}

}  // namespace morphray
