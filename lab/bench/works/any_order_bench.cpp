#include <algorithm>
#include <iterator>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/thread_arena.h"
#include "lab/bench/peer.h"
#include "lab/bench/questions/question_work.h"
#include "lab/bench/user_scene.h"
#include "lab/bench/works/ray_shuffle.h"
#include "lab/bench/works/works.h"
#include "morphray/morphray.hpp"

namespace mray::bench {
namespace {

std::vector<Ray> active_rays(const TraceWork& work) {
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < work.rays.size(); ++i) {
        if (work.active[i] != 0) rays.push_back(work.rays[i]);
    }
    return rays;
}

/// The scene behind the public interface, on one target, and Embree's.
class AnyOrder {
public:
    AnyOrder(const Rig& rig, const BenchScene& scene, const EmbreeScenes& embree,
             const SimdTarget& target)
        : rig_(rig),
          scene_(scene),
          embree_(embree),
          target_(target),
          points_(to_user(scene.positions)),
          user_(build()),
          arena_(rig.threads) {}

    void compare_times(const std::string& kind, std::vector<Ray> rays) {
        const TraceWork work = make_one_ray_work(scene_.params, shuffled(std::move(rays)));
        if (work.rays.empty()) return;
        const std::vector<morphray::Ray> user_rays = to_user(work.rays);
        std::vector<morphray::Hit> hits(user_rays.size());
        const std::vector<Peer> peers = embree_peers(embree_, work);
        std::vector<Method> methods = {{"Scene::intersect, any order, " + kind, {}, [&] {
                                            user_.intersect(
                                                std::span<const morphray::Ray>(user_rays),
                                                std::span(hits), morphray::Coherence::sort());
                                        }}};
        for (const Peer& peer : peers) {
            methods.push_back({peer.name, [&] { arena_.execute([&] { peer.prepare(); }); },
                               [&] { arena_.execute([&] { peer.trace(work.whole()); }); }});
        }
        const std::vector<Samples> samples = time_interleaved(methods, rig_.repeat);
        std::vector<Times> times;
        std::transform(samples.begin(), samples.end(), std::back_inserter(times),
                       [](const Samples& some) { return times_of(some); });
        const std::span<const Times> peer_times = std::span(times).subspan(1);
        TraceAnswers ours(work);
        std::transform(hits.begin(), hits.end(), ours.hits.begin(), [](const morphray::Hit& hit) {
            return hit ? Hit{hit.t, hit.u, hit.v, hit.prim_id} : Hit{};
        });
        for (const std::size_t best : fastest_of_groups(peers, peer_times, 1)) {
            const TraceAnswers theirs = arena_.execute([&] {
                peers[best].prepare();
                peers[best].trace(work.whole());
                return peers[best].answers();
            });
            Row row = row_of(rig_, scene_, work, theirs);
            row.work = "any-order";
            row.tracer = methods.front().name;
            row.target = target_.name;
            row.peer = peers[best].name;
            row.mismatches = compare_answers(work, ours, theirs);
            set_times(row, times.front(), peer_times[best], Unit::kMrayPerSecond,
                      work.active_count);
            rig_.report(row);
        }
    }

private:
    morphray::Scene build() const {
        const auto& triangles = scene_.topology().triangles;
        return morphray::Scene::build(
            {.positions = morphray::packed(points_),
             .triangles = {&triangles.data()->x, 3 * triangles.size()}},
            morphray::Device::cpu({.threads = rig_.threads, .simd = target_.name}),
            {.bounds = kUserBounds});
    }

    const Rig& rig_;
    const BenchScene& scene_;
    const EmbreeScenes& embree_;
    SimdTarget target_;
    std::vector<morphray::Vec3> points_;
    morphray::Scene user_;
    ThreadArena arena_;
};

}  // namespace

void bench_any_order(const Rig& rig, const BenchScene& scene, const EmbreeScenes& embree,
                     const TraceWork& primary, std::span<const Hit> hits) {
    const TraceWork diffuse = make_secondary_work(primary, hits, scene.mesh(), WorkKind::kDiffuse);
    for (const SimdTarget& target : rig.targets) {
        AnyOrder any_order(rig, scene, embree, target);
        any_order.compare_times("camera rays", primary.rays);
        any_order.compare_times("diffuse rays", active_rays(diffuse));
        any_order.compare_times("random rays", random_rays(scene, primary.rays.size()));
    }
}

}  // namespace mray::bench
