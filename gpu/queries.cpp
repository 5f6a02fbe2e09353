#include "gpu/queries.h"

#include <numeric>

#include "common/interop/tie_break_rule.h"
#include "common/interop/winding_rule.h"
#include "common/watched_runs.h"

namespace mray::gpu {
namespace {

std::uint32_t flags_of(Crossing crossing) {
    return crossing == Crossing::kOwner ? kQueryTieBreak : 0;
}

Hit hit_of(const uvec4& answer) {
    if (answer.w == kNoPrim) return no_hit();
    return {uintBitsToFloat(answer.x), uintBitsToFloat(answer.y), uintBitsToFloat(answer.z),
            answer.w};
}

uvec4 words_of(const vec3& p, float w) {
    return {floatBitsToUint(p.x), floatBitsToUint(p.y), floatBitsToUint(p.z), floatBitsToUint(w)};
}

/// The number of all hits of a ray, with kTouchesBorder.
std::uint64_t count_of(const std::vector<Hit>& hits) {
    const bool touches =
        std::ranges::any_of(hits, [](const Hit& hit) { return may_touch_border(hit.u, hit.v); });
    return hits.size() | (touches ? kTouchesBorder : 0);
}

/// A ray from a cursor on, and the lowest prim_id of the hits at its tnear that count.
std::uint32_t start_after(const HitCursor& after, Ray& ray) {
    if (after.t < ray.tnear) return 0;
    if (after.prim_id == kNoPrim) {
        ray.tnear = std::nextafter(after.t, std::numeric_limits<float>::infinity());
        return 0;
    }
    ray.tnear = after.t;
    return after.prim_id + 1;
}

class Queries {
public:
    Queries(Transfer& transfer, Kernels& kernels, RayPasses& passes, const SceneBuffers& scene)
        : transfer_(transfer), kernels_(kernels), passes_(passes), scene_(scene) {}

    void answer(const CountQuery& query) const {
        std::vector<uvec4> answers;
        for_parts(query.rays, query.watch, [&](std::size_t first, std::size_t size) {
            run("count hits", kernels_.hits, kQueryCount | flags_of(query.crossing),
                query.rays.subspan(first, size), answers);
            for (std::size_t i = 0; i < size; ++i) {
                const std::uint32_t count = answers[i].x;
                query.counts[first + i] =
                    (count & ~kCountTouches) | ((count & kCountTouches) != 0 ? kTouchesBorder : 0);
            }
        });
    }

    void answer(const NextQuery& query) const {
        std::vector<Ray> rest;
        std::vector<std::uint32_t> first_prims;
        std::vector<uvec4> answers;
        for_parts(query.rays, query.watch, [&](std::size_t first, std::size_t size) {
            const std::span<const Ray> rays = query.rays.subspan(first, size);
            rest.assign(rays.begin(), rays.end());
            first_prims.resize(size);
            for (std::size_t i = 0; i < size; ++i)
                first_prims[i] = start_after(query.after[first + i], rest[i]);
            transfer_.upload(std::as_bytes(std::span(first_prims)),
                             passes_.buffers()->visible_pixels.buffer);
            run("find next hits", kernels_.hits, flags_of(query.crossing), std::span(rest),
                answers);
            for (std::size_t i = 0; i < size; ++i) query.hits[first + i] = hit_of(answers[i]);
        });
    }

    void answer(const ListQuery& query) const {
        for_parts(query.rays, query.watch,
                  [&](std::size_t first, std::size_t size) { list_part(query, first, size); });
    }

    void answer(const WindingQuery& query) const {
        for_parts(query.points, query.watch,
                  [&](std::size_t first, std::size_t size) { wind_part(query, first, size); });
    }

    void answer(const ClosestQuery& query) const {
        std::vector<uvec4> points;
        std::vector<uvec4> answers;
        for_parts(query.points, query.watch, [&](std::size_t first, std::size_t size) {
            points.resize(size);
            for (std::size_t i = 0; i < size; ++i)
                points[i] = words_of(query.points[first + i], query.most_d2);
            run("find closest triangles", kernels_.closest, 0, std::span(points), answers);
            for (std::size_t i = 0; i < size; ++i)
                query.closest[first + i] = {uintBitsToFloat(answers[i].x), answers[i].y};
        });
    }

private:
    /// The pairs that the pixels have room for.
    std::uint32_t pair_room() const { return passes_.size().rays() / 2; }

    /// Calls work(first, count) for parts of a query that take a submission each, some ms if the
    /// caller may cancel. Throws Error(kCancelled).
    template <class Asked, class Work>
    void for_parts(std::span<const Asked> asked, const Watch& watch, Work work) const {
        constexpr std::size_t kLeast = 64;
        for_watched_runs(0, asked.size(), watch, passes_.size().rays(), kLeast, work);
        watch.throw_if_cancelled();
    }

    /// Answers rays, or points in words. Returns how many pairs the kernel has found; the pixels
    /// have the first pair_room() of them.
    template <class Asked>
    std::uint32_t run(const char* what, QueryKernel& kernel, std::uint32_t flags,
                      std::span<Asked> asked, std::vector<uvec4>& answers) const {
        kernels_.prepare({&kernel.begin});
        transfer_.upload(std::as_bytes(asked), passes_.buffers()->rays.buffer);
        answers.resize(asked.size());
        const std::uint32_t found =
            passes_.answer(what, kernel,
                           {.first = 0,
                            .count = static_cast<std::uint32_t>(answers.size()),
                            .round = kRoundAll,
                            .flags = flags,
                            .repeated_count = static_cast<std::uint32_t>(scene_.repeated().size()),
                            .pair_room = pair_room()});
        transfer_.download(passes_.buffers()->hits.buffer,
                           std::as_writable_bytes(std::span(answers)));
        return found;
    }

    /// Finds hit after hit, and then the numbers for rays that may have more than are listed.
    void list_part(const ListQuery& query, std::size_t first, std::size_t size) const {
        const std::span<const Ray> rays = query.rays.subspan(first, size);
        HitLists& lists = query.lists;
        std::vector<std::vector<Hit>> found(rays.size());
        std::vector<std::size_t> left(query.most > 0 ? rays.size() : 0);
        std::iota(left.begin(), left.end(), std::size_t{0});
        std::vector<Ray> asked(rays.begin(), rays.end());
        std::vector<HitCursor> after(rays.size());
        std::vector<Hit> next(rays.size());
        while (!left.empty()) {
            query.watch.throw_if_cancelled();
            const std::size_t count = left.size();
            answer(NextQuery{std::span(asked).first(count), std::span(after).first(count),
                             query.crossing, std::span(next).first(count)});
            std::size_t kept = 0;
            for (std::size_t i = 0; i < count; ++i) {
                if (next[i].prim_id == kNoPrim) continue;
                found[left[i]].push_back(next[i]);
                if (found[left[i]].size() == query.most) continue;
                left[kept] = left[i];
                asked[kept] = asked[i];
                after[kept++] = {next[i].t, next[i].prim_id};
            }
            left.resize(kept);
        }
        std::vector<Ray> full;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            if (found[i].size() == query.most) full.push_back(rays[i]);
        }
        std::vector<std::uint64_t> counts(full.size());
        if (!full.empty()) answer(CountQuery{full, query.crossing, counts});
        auto count = counts.begin();
        for (const std::vector<Hit>& hits : found) {
            lists.hits.insert(lists.hits.end(), hits.begin(), hits.end());
            lists.listed.push_back(static_cast<std::uint32_t>(hits.size()));
            lists.total.push_back(hits.size() == query.most ? *count++ : count_of(hits));
        }
    }

    /// One part of the points. If there is no room for all uncertain crossings, it is divided.
    void wind_part(const WindingQuery& query, std::size_t first, std::size_t size) const {
        std::vector<uvec4> points(size);
        std::vector<uvec4> answers;
        for (std::size_t i = 0; i < size; ++i)
            points[i] = words_of(clipped_point(query.points[first + i]), 0);
        const std::uint32_t found =
            run("wind around points", kernels_.winding, 0, std::span(points), answers);
        const std::size_t room = pair_room();
        if (found > room && size > 1) {
            wind_part(query, first, size / 2);
            wind_part(query, first + size / 2, size - size / 2);
            return;
        }
        for (std::size_t i = 0; i < size; ++i) {
            query.windings[first + i] = {.winding = static_cast<std::int32_t>(answers[i].x),
                                         .crossings = answers[i].y};
        }
        if (found > room) {
            throw Error(
                ErrorKind::kLimit,
                "Vulkan: more triangles meet in one place than the device has room for; use "
                "the CPU backend");
        }
        std::vector<UncertainCrossing> pairs(found);
        transfer_.download(passes_.buffers()->pixels, std::as_writable_bytes(std::span(pairs)));
        // Pairs are there twice for queries that began again at the root.
        std::sort(pairs.begin(), pairs.end());
        pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
        for (UncertainCrossing pair : pairs) {
            pair.point += static_cast<std::uint32_t>(first);
            query.uncertain.push_back(pair);
            for (const RepeatedTriangle& repeat : repeats_of(scene_.repeated(), pair.prim_id))
                query.uncertain.push_back({pair.point, repeat.prim_id});
        }
    }

    Transfer& transfer_;
    Kernels& kernels_;
    RayPasses& passes_;
    const SceneBuffers& scene_;
};

}  // namespace

void answer(const QueryBatch& batch, Transfer& transfer, Kernels& kernels, RayPasses& passes,
            const SceneBuffers& scene) {
    const Queries queries(transfer, kernels, passes, scene);
    std::visit(
        [&]<class Query>(const Query& query) {
            if constexpr (kIsForDevices<Query>) {
                if (query.filter == nullptr) return queries.answer(query);
            }
            throw Error(ErrorKind::kInternal, "a device was asked what only the host answers");
        },
        batch);
}

}  // namespace mray::gpu
