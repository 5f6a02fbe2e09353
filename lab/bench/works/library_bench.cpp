#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "common/base/thread_arena.h"
#include "common/ray_queries.h"
#include "common/scene/camera_setup.h"
#include "cpu/cpu_backend.h"
#include "lab/bench/questions/question_work.h"
#include "lab/bench/user_scene.h"
#include "lab/bench/works/ray_shuffle.h"
#include "lab/bench/works/works.h"
#include "morphray/morphray.hpp"

namespace mray::bench {
namespace {

using UserRays = std::vector<morphray::Ray>;
using UserHits = std::vector<morphray::Hit>;

/// The number of the first hits that differ in any bit.
Mismatches compare(const UserHits& ours, std::span<const Hit> theirs, std::size_t count) {
    Mismatches mismatches;
    for (std::size_t i = 0; i < count; ++i) {
        const Hit& hit = theirs[i];
        const bool same = ours[i].prim_id == hit.prim_id && ours[i].t == hit.t &&
                          ours[i].u == hit.u && ours[i].v == hit.v;
        mismatches.hit += same ? 0 : 1;
    }
    return mismatches;
}

/// The share of hits among the first answers.
double share_of_hits(const UserHits& hits, std::size_t count) {
    const auto end = hits.begin() + static_cast<std::ptrdiff_t>(count);
    const auto is_hit = [](const morphray::Hit& hit) { return bool{hit}; };
    return static_cast<double>(std::count_if(hits.begin(), end, is_hit)) /
           static_cast<double>(count);
}

/// The same scene behind the public interface and behind the seam, on one target.
class BothSides {
public:
    BothSides(const Rig& rig, const BenchScene& scene, const SimdTarget& target)
        : rig_(rig), scene_(scene), target_(target), points_(scene.positions.size()) {
        place(scene.positions);
        const auto& triangles = scene.topology().triangles;
        user_.emplace(morphray::Scene::build(
            {.positions = morphray::packed(points_),
             .triangles = {&triangles.data()->x, 3 * triangles.size()}},
            morphray::Device::cpu({.threads = rig.threads, .simd = target.name}),
            {.bounds = kUserBounds, .update = morphray::Refit{}}));
        backend_ = cpu::make_cpu_backend({.threads = rig.threads, .simd = target.name});
        backend_->set_scene(scene.topology(), scene.positions, scene.bvh);
    }

    void place(std::span<const vec3> positions) {
        std::transform(positions.begin(), positions.end(), points_.begin(),
                       [](vec3 p) { return to_user(p); });
    }
    morphray::Scene& user() { return *user_; }
    Backend& backend() { return *backend_; }

    /// Times both, and reports the first against the second.
    void compare_times(const Method& ours, const Method& peer, std::uint64_t rays, double hit_share,
                       const Mismatches& mismatches) {
        const Method methods[] = {ours, peer};
        const std::vector<Samples> samples = time_interleaved(methods, rig_.repeat);
        Row row = row_of(rig_, scene_, "library");
        row.rays = rays;
        row.hit_share = hit_share;
        row.tracer = ours.name;
        row.target = target_.name;
        row.peer = peer.name;
        row.mismatches = mismatches;
        if (rays != 0) {
            set_times(row, times_of(samples[0]), times_of(samples[1]), Unit::kMrayPerSecond, rays);
        } else {
            set_times(row, times_of(samples[0]), times_of(samples[1]), Unit::kNsPerTriangle,
                      row.triangles);
        }
        rig_.report(row);
    }

private:
    const Rig& rig_;
    const BenchScene& scene_;
    SimdTarget target_;
    std::vector<morphray::Vec3> points_;
    std::optional<morphray::Scene> user_;
    std::unique_ptr<Backend> backend_;
};

/// Rays on both sides, and their hits.
struct BothRays {
    explicit BothRays(std::vector<Ray> backend_rays)
        : backend(std::move(backend_rays)),
          user(to_user(backend)),
          backend_hits(backend.size()),
          user_hits(backend.size()) {}

    std::vector<Ray> backend;
    UserRays user;
    AlignedVector<Hit> backend_hits;
    UserHits user_hits;
};

/// Calls `work(first, count)` for calls of at most `size` rays.
template <class Work>
void for_each_call(std::size_t total, std::size_t size, Work work) {
    for (std::size_t first = 0; first < total; first += size)
        work(first, std::min(size, total - first));
}

/// Camera rays that are handed over as plain rays, against packets that make their own.
void bench_camera_rays(BothSides& sides, const ImageParams& params) {
    BothRays rays(camera_rays(params));
    Frame frame;
    const auto ours = [&] {
        sides.user().intersect(std::span<const morphray::Ray>(rays.user), std::span(rays.user_hits),
                               morphray::Coherence::image(params.width));
    };
    ours();
    sides.backend().trace_image(params, frame);
    sides.compare_times(
        {"Scene::intersect, camera rays", {}, ours},
        {"image of packets", {}, [&] { sides.backend().trace_image(params, frame); }},
        rays.user.size(), share_of_hits(rays.user_hits, rays.user.size()),
        compare(rays.user_hits, frame.hits, frame.hits.size()));
}

/// Rays in any order, in calls of `size` rays.
void bench_calls(BothSides& sides, BothRays& rays, std::size_t size) {
    constexpr std::size_t kMostCalls = 1 << 16;
    const std::size_t total = std::min(rays.user.size(), size * kMostCalls);
    const auto ours = [&] {
        for_each_call(total, size, [&](std::size_t first, std::size_t count) {
            if (size == 1) {
                rays.user_hits[first] = sides.user().intersect(rays.user[first]);
            } else {
                sides.user().intersect(
                    std::span<const morphray::Ray>(rays.user).subspan(first, count),
                    std::span(rays.user_hits).subspan(first, count), morphray::Coherence::sort());
            }
        });
    };
    const auto peer = [&] {
        for_each_call(total, size, [&](std::size_t first, std::size_t count) {
            const auto some = std::span<const Ray>(rays.backend).subspan(first, count);
            const auto hits = std::span(rays.backend_hits).subspan(first, count);
            size == 1 ? sides.backend().queries()->intersect(some, hits)
                      : sides.backend().trace_rays(some, hits);
        });
    };
    ours();
    peer();
    sides.compare_times({fmt::format("Scene::intersect, calls of {}", size), {}, ours},
                        {fmt::format("single rays, calls of {}", size), {}, peer}, total,
                        share_of_hits(rays.user_hits, total),
                        compare(rays.user_hits, rays.backend_hits, total));
}

/// An update of all positions, against one read of them and the refit.
void bench_update(const Rig& rig, BothSides& sides, const BenchScene& scene) {
    std::size_t round = 0;
    const auto frame = [&] {
        return std::span<const vec3>(round % 2 == 0 ? scene.moved : scene.positions);
    };
    std::vector<vec3> read(scene.positions.size());
    ThreadArena arena(rig.threads);
    using Range = tbb::blocked_range<std::size_t>;
    sides.compare_times(
        {"Scene::update", [&] { sides.place(frame()); }, [&] { sides.user().update(); }},
        {"copy of positions, refit",
         {},
         [&] {
             const std::span<const vec3> from = frame();
             arena.execute([&] {
                 tbb::parallel_for(Range(0, read.size(), 8192), [&](const Range& range) {
                     std::copy(from.begin() + static_cast<std::ptrdiff_t>(range.begin()),
                               from.begin() + static_cast<std::ptrdiff_t>(range.end()),
                               read.begin() + static_cast<std::ptrdiff_t>(range.begin()));
                 });
             });
             sides.backend().refit(read);
             ++round;
         }},
        0, 0, {});
}

}  // namespace

void bench_library(const Rig& rig, const BenchScene& scene) {
    for (const SimdTarget& target : rig.targets) {
        BothSides sides(rig, scene, target);
        bench_camera_rays(sides, scene.params);
        BothRays rays(shuffled(camera_rays(scene.params)));
        for (const std::size_t size : {std::size_t{1}, std::size_t{16}, std::size_t{256},
                                       std::size_t{1} << 16, rays.user.size()})
            bench_calls(sides, rays, size);
        bench_update(rig, sides, scene);
    }
}

}  // namespace mray::bench
