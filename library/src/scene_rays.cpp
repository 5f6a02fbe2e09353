// The members of Scene that trace rays, and the normals of hits.
#include <cmath>
#include <numeric>

#include <glm/geometric.hpp>

#include "common/interop/hit_rule.h"
#include "common/interop/shading.h"
#include "common/interop/tie_break_rule.h"
#include "common/scene/exact_crossing.h"
#include "library/src/query_batches.h"
#include "library/src/query_filter.h"

namespace morphray {
namespace {

using namespace detail;

// Answers of a tile are prefetched this many rows ahead, since processors do not do that.
constexpr std::size_t kRowsAhead = 2;
// Rays that are gathered are prefetched this many ahead.
constexpr std::size_t kRaysAhead = 16;
// Rays of a submission to a device, which cannot be interrupted.
constexpr std::size_t kDeviceBatch = std::size_t{1} << 18;
// Rows of fewer rays are not traced as an image.
constexpr std::size_t kLeastWidth = 8;
constexpr std::uint32_t kAllHits = std::numeric_limits<std::uint32_t>::max();

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
    const mray::StoredRayTile tile{reinterpret_cast<const mray::StoredRay*>(rays.data()), row,
                                   static_cast<std::uint32_t>(width),
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

/// Traces a part of the rays on the host until it is cancelled.
template <class Answer>
void trace_on_host(SceneImpl& scene, std::span<const Ray> part,
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

/// Traces rays on a device, and converts them in many threads. The reported cost leaves out what
/// the tree has no part in, such as waiting for other threads and compiling kernels.
class DeviceTrace {
public:
    explicit DeviceTrace(SceneImpl& scene) : scene_(scene) {}

    /// The rays of `order`, or all.
    template <class Answer>
    void trace(std::span<const Ray> part, std::span<const std::uint32_t> order,
               std::span<Answer> answers) {
        const std::size_t size = order.empty() ? part.size() : order.size();
        rays_.resize(size);
        t_exponents_.resize(size);
        hits_.resize(size);
        const auto for_runs = [&](auto work) { for_each_run(&scene_.arena(), size, {}, work); };
        for_runs([&](std::size_t first, std::size_t count) {
            std::array<Ray, kRun> room;
            mray::cpu::SceneRays run;
            scene_.space().to_scene(in_order(part, order, first, count, room), run);
            for (std::size_t i = 0; i < count; ++i) {
                rays_[first + i] = run.rays[i];
                t_exponents_[first + i] = run.t_exponents[2 * i + 1];
            }
        });
        {
            const std::scoped_lock lock(scene_.mutex());
            scene_.tracer().trace({rays_, hits_});
            scene_.cost.add(scene_.tracer().finish().trace_ms, size);
        }
        for_runs([&](std::size_t first, std::size_t count) {
            for (std::size_t i = first; i < first + count; ++i) {
                const std::size_t at = order.empty() ? i : order[i];
                set_answer(scene_, part[at], hits_[i], t_exponents_[i], answers[at]);
            }
        });
    }

private:
    SceneImpl& scene_;
    std::vector<mray::Ray> rays_;
    std::vector<int> t_exponents_;
    std::vector<mray::Hit> hits_;
};

/// Answers rays that see everything.
template <class Answer>
void trace_all(SceneImpl& scene, std::span<const Ray> rays, std::span<Answer> answers,
               const QueryOptions& options) {
    const mray::Watch watch(options.cancel);
    const Coherence coherence = options.coherence;
    const bool sorts = coherence.kind == Coherence::Kind::sort;
    if (!scene.tracer().info().answers_threads) {
        DeviceTrace device(scene);
        const auto trace_batch = [&](std::size_t first, auto batch, auto order) {
            const auto trace_run = [&](std::size_t begin, std::size_t size) {
                if (order.empty()) {
                    device.trace(batch.subspan(begin, size), order,
                                 answers.subspan(first + begin, size));
                } else {
                    device.trace(batch, order.subspan(begin, size),
                                 answers.subspan(first, batch.size()));
                }
            };
            for_runs_of(0, batch.size(), watch, trace_run, kDeviceBatch, kLeastDeviceRun);
        };
        for_ordered_batches(scene, rays, sorts, kDeviceBatch, &scene.arena(), watch, trace_batch);
        watch.throw_if_cancelled();
        return;
    }
    const bool is_alone = options.threads == Threads::calling || rays.size() <= kFewRays;
    mray::ThreadArena* const arena = is_alone ? nullptr : &scene.arena();
    scene.cost.measure(rays.size(), [&] {
        std::size_t done = 0;
        if (coherence.kind == Coherence::Kind::image && coherence.width >= kLeastWidth)
            done = trace_image(scene, rays, answers, coherence.width, arena, watch);
        scene.cost.mark_image(done);
        const auto trace_batch = [&](std::size_t first, auto batch, auto order) {
            trace_on_host(scene, batch, order, answers.subspan(done + first, batch.size()), arena,
                          watch);
        };
        for_ordered_batches(scene, rays.subspan(done), sorts, RaySorter::kMost, arena, watch,
                            trace_batch);
        watch.throw_if_cancelled();
    });
}

/// Rays in scene space, and what their t is multiplied by.
struct SceneBatch {
    std::vector<mray::Ray> rays;
    std::vector<int> t_exponents;

    SceneBatch(const RaySpace& space, std::span<const Ray> world) {
        rays.reserve(world.size());
        t_exponents.reserve(world.size());
        for_runs_of(0, world.size(), {}, [&](std::size_t first, std::size_t count) {
            mray::cpu::SceneRays run;
            space.to_scene(world.subspan(first, count), run);
            rays.insert(rays.end(), run.rays, run.rays + count);
            for (std::size_t i = 0; i < count; ++i)
                t_exponents.push_back(run.t_exponents[2 * i + 1]);
        });
    }
};

/// A filter as arguments of ray queries that the host's tree answers. It is empty on a device,
/// whose hits are filtered afterwards. The filter must outlive it.
struct RayFilter {
    mray::SeesTriangle sees;
    mray::HidesSubtree hides;

    /// number(i): that of ray i of the query in the filter.
    template <class Number>
    RayFilter(SceneImpl& scene, const QueryFilter& filter, Number number) {
        if (!scene.tracer().info().answers_threads) return;
        sees = filter.seen_by(number);
        if (filter.hides_meshes()) hides = filter.hidden_from(number, scene.meshes_of_subtrees());
    }
    template <class Query>
    Query applied_to(Query query) const {
        if (sees) query.sees = &sees;
        if (hides) query.hides = &hides;
        return query;
    }
};

/// A ray in the calling thread, without the memory of runs.
template <class Answer>
Answer trace_one(SceneImpl& scene, const Ray& ray) {
    Answer answer{};
    if (!scene.tracer().info().answers_threads) {
        DeviceTrace(scene).trace({&ray, 1}, {}, std::span(&answer, 1));
        return answer;
    }
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

mray::Crossing crossing_of(Crossing crossing) {
    return crossing == Crossing::owner ? mray::Crossing::kOwner : mray::Crossing::kEach;
}

/// Takes kTouchesBorder from a number of hits; returns whether Crossing::once may count fewer.
bool take_border_flag(std::uint64_t& count, Crossing crossing) {
    const bool touches = (count & mray::kTouchesBorder) != 0;
    count &= ~mray::kTouchesBorder;
    return touches && count > 1 && crossing == Crossing::once;
}

/// The hits of each ray with triangles that it sees: the first `most`, which a device lists before
/// they are filtered. rays[i] has number(i) in the filter.
template <class Number>
std::vector<std::vector<mray::Hit>> list_hits(SceneImpl& scene, std::span<const mray::Ray> rays,
                                              Crossing crossing, const QueryFilter& filter,
                                              Number number, std::uint32_t most = kAllHits) {
    std::vector<std::vector<mray::Hit>> all(rays.size());
    if (rays.empty()) return all;
    mray::HitLists lists;
    const RayFilter own(scene, filter, number);
    scene.tracer().query(
        own.applied_to(mray::ListQuery{rays, crossing_of(crossing), most, lists, filter.watch()}));
    auto next = lists.hits.cbegin();
    for (std::size_t i = 0; i < rays.size(); ++i) {
        filter.watch().throw_if_cancelled();
        std::vector<mray::Hit>& hits = all[i];
        hits.assign(next, next + lists.listed[i]);
        next += lists.listed[i];
        if (!own.sees)
            std::erase_if(
                hits, [&](const mray::Hit& hit) { return !filter.sees(number(i), hit.prim_id); });
        if (take_border_flag(lists.total[i], crossing))
            mray::keep_one_of_each_crossing(scene.meshes().topology(), scene.pose().positions(),
                                            scene.meshes().first_prims(), rays[i], hits);
    }
    return all;
}

/// Replaces hits with triangles that the filter leaves out by the next hits of their rays.
void pass_unseen(SceneImpl& scene, const QueryFilter& filter, std::span<const Ray> rays,
                 std::span<Hit> hits, const QueryOptions& options) {
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < rays.size(); ++i)
        if (hits[i] && !filter.sees(i, hits[i])) places.push_back(i);
    if (places.empty()) return;
    query_tracer(scene, places.size(), options, [&](std::size_t begin, std::size_t count) {
        const std::span<const std::size_t> part = std::span(places).subspan(begin, count);
        std::vector<Ray> passing(count);
        for (std::size_t i = 0; i < count; ++i) passing[i] = rays[part[i]];
        const SceneBatch batch(scene.space(), passing);
        std::vector<mray::Hit> found(count);
        const auto number = [&](std::size_t i) { return part[i]; };
        if (scene.tracer().info().answers_threads) {
            const RayFilter own(scene, filter, number);
            const std::vector<mray::HitCursor> start(count);
            scene.tracer().query(own.applied_to(
                mray::NextQuery{batch.rays, start, mray::Crossing::kEach, found, filter.watch()}));
        } else {
            const std::uint32_t most = filter.hides_meshes() ? kAllHits : 2;
            const auto seen = list_hits(scene, batch.rays, Crossing::each, filter, number, most);
            for (std::size_t i = 0; i < count; ++i)
                found[i] = seen[i].empty() ? mray::no_hit() : seen[i].front();
        }
        for (std::size_t i = 0; i < count; ++i)
            set_answer(scene, passing[i], found[i], batch.t_exponents[i], hits[part[i]]);
    });
}

void find_closest(SceneImpl& scene, std::span<const Ray> rays, std::span<Hit> hits,
                  const QueryOptions& options) {
    require_room(rays.size(), "rays", hits.size());
    const QueryFilter filter(scene.meshes(), rays.size(), "rays", options);
    trace_all(scene, rays, hits, options);
    if (!filter.sees_all()) pass_unseen(scene, filter, rays, hits, options);
}

/// All hits of some rays of a batch, by their places in it.
struct WholeLists {
    std::vector<std::size_t> places;
    std::vector<std::vector<mray::Hit>> hits;
};

/// Lists all hits of rays for which the tracer's numbers of hits are too large: rays that do not
/// see everything, and by Crossing::once those that touch borders. Corrects the numbers.
template <class Number>
WholeLists list_uncertain(SceneImpl& scene, std::span<const mray::Ray> rays, Crossing crossing,
                          const QueryFilter& filter, Number number,
                          std::span<std::uint64_t> totals) {
    WholeLists whole;
    std::vector<mray::Ray> whole_rays;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (filter.sees_all() && !take_border_flag(totals[i], crossing)) continue;
        whole.places.push_back(i);
        whole_rays.push_back(rays[i]);
    }
    whole.hits = list_hits(scene, whole_rays, crossing, filter,
                           [&](std::size_t k) { return number(whole.places[k]); });
    for (std::size_t k = 0; k < whole.hits.size(); ++k)
        totals[whole.places[k]] = whole.hits[k].size();
    return whole;
}

/// Lists the first hits of rays, which are those of the filter from `first` on.
mray::HitLists list_first_hits(SceneImpl& scene, std::span<const mray::Ray> rays,
                               const AllHitsOptions& options, const QueryFilter& filter,
                               std::size_t first) {
    mray::HitLists lists;
    if (filter.sees_all()) {
        scene.tracer().query(mray::ListQuery{rays, crossing_of(options.crossing), options.max_hits,
                                             lists, filter.watch()});
    } else {
        lists.listed.resize(rays.size());
        lists.total.resize(rays.size());
    }
    const WholeLists whole = list_uncertain(
        scene, rays, options.crossing, filter, [&](std::size_t i) { return first + i; },
        lists.total);
    if (whole.places.empty()) return lists;
    std::vector<mray::Hit> hits;
    auto next = lists.hits.cbegin();
    for (std::size_t i = 0, k = 0; i < rays.size(); ++i) {
        std::span<const mray::Hit> found(next, next + lists.listed[i]);
        next += lists.listed[i];
        if (k < whole.places.size() && whole.places[k] == i) {
            found = whole.hits[k++];
            found = found.first(std::min<std::size_t>(found.size(), options.max_hits));
            lists.listed[i] = static_cast<std::uint32_t>(found.size());
        }
        hits.insert(hits.end(), found.begin(), found.end());
    }
    lists.hits = std::move(hits);
    return lists;
}

mray::Hit find_next(SceneImpl& scene, const mray::Ray& ray, const mray::HitCursor& after,
                    Crossing crossing, const QueryFilter& filter) {
    const auto number = [](std::size_t) { return std::size_t{0}; };
    const RayFilter own(scene, filter, number);
    mray::Hit found;
    for (mray::HitCursor at = after;; at = {found.t, found.prim_id}) {
        scene.tracer().query(own.applied_to(
            mray::NextQuery{{&ray, 1}, {&at, 1}, crossing_of(crossing), {&found, 1}}));
        if (found.prim_id == mray::kNoPrim) return found;
        if (filter.sees(0, found.prim_id)) break;
    }
    if (crossing != Crossing::once || !mray::may_touch_border(found.u, found.v)) return found;
    const auto lists = list_hits(scene, {&ray, 1}, crossing, filter, number);
    for (const mray::Hit& hit : lists[0])
        if (mray::is_closer(after.t, after.prim_id, hit.t, hit.prim_id)) return hit;
    return mray::no_hit();
}

/// The places of an image's rays tile after tile, which are streams.
std::vector<std::uint32_t> tiled_places(std::size_t width, std::size_t total) {
    constexpr std::size_t kSide = 8;
    const std::size_t height = width < kSide ? 0 : total / width / kSide * kSide;
    std::vector<std::uint32_t> places(total);
    auto next = places.begin();
    for (std::size_t tile = 0; tile < height; tile += kSide)
        for (std::size_t left = 0; left < width; left += kSide)
            for (std::size_t y = tile; y < tile + kSide; ++y)
                for (std::size_t x = left; x < std::min(left + kSide, width); ++x)
                    *next++ = static_cast<std::uint32_t>(y * width + x);
    std::iota(next, places.end(), static_cast<std::uint32_t>(next - places.begin()));
    return places;
}

/// t in scene space of a hit of the last one of `passed` triangles by `world`, which is `ray`
/// there. A power of two gives it exactly, unless t is rounded in world space: a denormal, too
/// large for a float, or of a far ray. Then the triangle is intersected again.
float scene_t(const SceneImpl& scene, const Ray& world, const mray::Ray& ray, int t_exponent,
              float world_t, std::uint32_t passed) {
    using Limits = std::numeric_limits<float>;
    const float t = scene.space().to_scene_t(world, world_t, t_exponent);
    const bool is_exact =
        world_t >= Limits::min() && world_t < Limits::max() && !is_far(t_exponent);
    if (is_exact || passed == 0) return t;
    const mray::uvec3 corners = scene.meshes().topology().triangles[passed - 1];
    const std::span<const mray::vec3> positions = scene.pose().positions();
    mray::TriangleHit hit;
    const bool is_hit = mray::intersect_triangle(mray::shear_ray(ray.org, ray.dir), ray.tnear,
                                                 ray.tfar, positions[corners.x],
                                                 positions[corners.y], positions[corners.z], hit);
    return is_hit && scene.space().to_world_t(world, hit.t, t_exponent) == world_t ? hit.t : t;
}

/// The normals of the corners of the triangle, interpolated; `flat` where they are not smooth.
mray::vec3 smooth_normal_at(const mray::VertexNormals& smooth, std::uint32_t prim, const Hit& hit,
                            mray::vec3 flat) {
    const mray::uvec3 ids = smooth.ids()[prim];
    mray::vec3 corners[3];
    for (int k = 0; k < 3; ++k) {
        corners[k] = ids[k] == mray::kFlatCorner
                         ? flat
                         : mray::corner_normal(smooth.normals()[ids[k]], flat);
    }
    return mray::smooth_normal(corners[0], corners[1], corners[2], hit.u, hit.v);
}

}  // namespace

mray::vec3 detail::flat_normal(const SceneImpl& scene, std::uint32_t prim) {
    const mray::uvec3 corners = scene.meshes().topology().triangles[prim];
    const auto at = [&](std::uint32_t corner) {
        return glm::dvec3(scene.pose().positions()[corner]);
    };
    const glm::dvec3 normal =
        glm::cross(at(corners.y) - at(corners.x), at(corners.z) - at(corners.x));
    const double length = glm::length(normal);
    if (!(length > 0) || !std::isfinite(length)) return {0, 0, 0};
    return mray::vec3(normal / length);
}

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
        require_room(rays.size(), "rays", occluded.size());
        if (QueryFilter(scene.meshes(), rays.size(), "rays", options).sees_all()) {
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

void Scene::count(std::span<const Ray> rays, std::span<std::uint64_t> counts, Crossing crossing,
                  const QueryOptions& options) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        require_room(rays.size(), "rays", counts.size());
        const QueryFilter filter(scene.meshes(), rays.size(), "rays", options);
        const auto count_part = [&](std::size_t first, std::span<const Ray> part,
                                    std::span<const std::uint32_t> order) {
            query_tracer(scene, part.size(), options, [&](std::size_t begin, std::size_t size) {
                const auto place = [&](std::size_t i) {
                    return order.empty() ? begin + i : order[begin + i];
                };
                std::vector<Ray> gathered(order.empty() ? 0 : size);
                for (std::size_t i = 0; i < gathered.size(); ++i) gathered[i] = part[place(i)];
                const SceneBatch batch(
                    scene.space(), order.empty() ? part.subspan(begin, size) : std::span(gathered));
                std::vector<std::uint64_t> found(size);
                if (filter.sees_all()) {
                    scene.tracer().query(
                        mray::CountQuery{batch.rays, crossing_of(crossing), found, filter.watch()});
                }
                list_uncertain(
                    scene, batch.rays, crossing, filter,
                    [&](std::size_t i) { return first + place(i); }, found);
                for (std::size_t i = 0; i < size; ++i) counts[first + place(i)] = found[i];
            });
        };
        const mray::Watch watch(options.cancel);
        const bool sorts = options.coherence.kind == Coherence::Kind::sort;
        constexpr std::uint32_t kMostTiled = std::numeric_limits<std::uint32_t>::max();
        if (options.coherence.kind == Coherence::Kind::image && rays.size() <= kMostTiled) {
            count_part(0, rays, tiled_places(options.coherence.width, rays.size()));
        } else {
            for_ordered_batches(scene, rays, sorts, RaySorter::kMost, &scene.arena(), watch,
                                count_part);
        }
        watch.throw_if_cancelled();
    });
}

AllHits Scene::intersect_all(std::span<const Ray> rays, const AllHitsOptions& all_options,
                             const QueryOptions& options) const {
    struct BatchHits {
        std::size_t first;
        std::vector<std::uint32_t> listed;
        std::vector<std::uint64_t> total;
        std::vector<Hit> hits;
    };
    return with_scene(impl_, [&](SceneImpl& scene) {
        const QueryFilter filter(scene.meshes(), rays.size(), "rays", options);
        std::mutex mutex;
        std::vector<BatchHits> found;
        query_tracer(scene, rays.size(), options, [&](std::size_t begin, std::size_t size) {
            const SceneBatch batch(scene.space(), rays.subspan(begin, size));
            mray::HitLists lists = list_first_hits(scene, batch.rays, all_options, filter, begin);
            BatchHits own{begin, std::move(lists.listed), std::move(lists.total), {}};
            own.hits.reserve(lists.hits.size());
            auto hit = lists.hits.begin();
            for (std::size_t i = 0; i < size; ++i) {
                for (std::uint32_t k = 0; k < own.listed[i]; ++k)
                    own.hits.push_back(to_world(scene.meshes(), scene.space(), rays[begin + i],
                                                *hit++, batch.t_exponents[i]));
            }
            const std::scoped_lock lock(mutex);
            found.push_back(std::move(own));
        });
        std::ranges::sort(found, {}, &BatchHits::first);
        AllHits all;
        all.offsets.reserve(rays.size() + 1);
        all.left_out.reserve(rays.size());
        std::size_t hit_count = 0;
        for (const BatchHits& own : found) hit_count += own.hits.size();
        all.hits.reserve(hit_count);
        for (BatchHits& own : found) {
            for (std::size_t i = 0; i < own.listed.size(); ++i) {
                all.offsets.push_back(all.offsets.back() + own.listed[i]);
                all.left_out.push_back(own.total[i] - own.listed[i]);
            }
            all.hits.insert(all.hits.end(), own.hits.begin(), own.hits.end());
            own = {};
        }
        return all;
    });
}

Hit Scene::intersect(const Ray& ray, const Hit& after, Crossing crossing,
                     const QueryOptions& options) const {
    return with_scene(impl_, [&](SceneImpl& scene) -> Hit {
        if (std::isnan(after.t)) throw_bad_argument("after: its t is NaN");
        const QueryFilter filter(scene.meshes(), 1, "rays", options);
        Hit hit;
        if (!after) return hit;
        query_tracer(scene, 1, options, [&](std::size_t, std::size_t) {
            mray::Ray asked;
            const std::optional<int> t_exponent = scene.space().to_scene(ray, asked);
            if (!t_exponent) return;
            mray::HitCursor cursor;
            const std::uint32_t passed = scene.meshes().count_up_to(after.geom_id, after.prim_id);
            cursor.t = scene_t(scene, ray, asked, *t_exponent, after.t, passed);
            if (passed != 0) {
                cursor.prim_id = passed - 1;
            } else {  // All hits at this t come after it.
                cursor.t = std::nextafter(cursor.t, -std::numeric_limits<float>::infinity());
                cursor.prim_id = mray::kNoPrim;
            }
            hit = to_world(scene.meshes(), scene.space(), ray,
                           find_next(scene, asked, cursor, crossing, filter), *t_exponent);
        });
        return hit;
    });
}

void Scene::normals(std::span<const Hit> hits, std::span<Vec3> normals, bool smooth) const {
    with_scene(impl_, [&](SceneImpl& scene) {
        require_room(hits.size(), "hits", normals.size());
        const MeshList& meshes = scene.meshes();
        for (const Hit& hit : hits) {
            const MeshSlot* const mesh = meshes.find(hit.geom_id);
            if (hit && (mesh == nullptr || hit.prim_id >= mesh->prim_count))
                throw_bad_argument("hits: there is no triangle {} of a mesh {}", hit.prim_id,
                                   hit.geom_id);
        }
        const mray::VertexNormals* smooth_normals = nullptr;
        if (smooth && meshes.is_smooth()) {
            const std::scoped_lock lock(scene.mutex());
            smooth_normals = &scene.normals();
        }
        for_each_run(&scene.arena(), hits.size(), {}, [&](std::size_t first, std::size_t count) {
            for (std::size_t i = first; i < first + count; ++i) {
                mray::vec3 normal(0, 0, 0);
                if (const Hit& hit = hits[i]) {
                    const std::uint32_t prim = meshes.find(hit.geom_id)->first_prim + hit.prim_id;
                    normal = flat_normal(scene, prim);
                    const bool has_area = normal.x != 0 || normal.y != 0 || normal.z != 0;
                    if (smooth_normals != nullptr && has_area)
                        normal = smooth_normal_at(*smooth_normals, prim, hit, normal);
                }
                normals[i] = {normal.x, normal.y, normal.z};
            }
        });
    });
}

}  // namespace morphray
