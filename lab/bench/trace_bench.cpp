#include <utility>

#include "common/simd/simd_target.h"
#include "lab/bench/peer_tree.h"
#include "lab/bench/works.h"

namespace mray::bench {
namespace {

// A part takes 0.2 ms: long beside clock and start of tasks, short beside disturbances.
constexpr std::size_t kTilesOfPart = 16;
// Every method traces each n-th part a few times to find out which peers are the fastest.
constexpr std::size_t kTrialStride = 4;
constexpr int kTrialRounds = 2;
// Peers of each group that are measured in full, because a short trial may take the wrong one.
constexpr std::size_t kFinalists = 2;

std::vector<Method> methods_of(const std::vector<Tracer>& tracers, ThreadArena& arena,
                               std::span<const WorkPart> parts) {
    std::vector<Method> methods;
    for (const Tracer& tracer : tracers) {
        const auto run = [&tracer, &arena, parts](std::size_t part) {
            return timed_in(arena, [&] { tracer.trace(parts[part]); });
        };
        methods.push_back({tracer.name, {}, run, tracer.group});
    }
    return methods;
}

std::vector<Tracer> finalists_of(std::vector<Tracer> peers, ThreadArena& arena,
                                 std::span<const WorkPart> all_parts) {
    std::vector<WorkPart> parts;
    for (std::size_t i = 0; i < all_parts.size(); i += kTrialStride) parts.push_back(all_parts[i]);
    const std::vector<Method> methods = methods_of(peers, arena, parts);
    const std::vector<Times> times = time_in_turn(methods, parts.size(), kTrialRounds);
    std::vector<Tracer> finalists;
    for (const std::size_t i : fastest_of_groups(methods, times, kFinalists))
        finalists.push_back(std::move(peers[i]));
    return finalists;
}

/// Packets are not compared with calls of one ray.
bool comparable(const Tracer& ours, const Tracer& peer) {
    return ours.at_once == RaysAtOnce::kStream ||
           (ours.at_once == RaysAtOnce::kOne) == (peer.at_once == RaysAtOnce::kOne);
}

}  // namespace

void bench_trace(const Rig& rig, const BenchScene& scene, const EmbreeScenes& embree,
                 const TraceWork& work) {
    ThreadArena arena(rig.threads);
    const std::vector<WorkPart> parts =
        work.parts(work.tiles.size() / (kTilesOfPart * static_cast<std::size_t>(rig.threads)));
    PeerTree paper_tree;
    std::vector<Tracer> tracers = finalists_of(embree_peers(embree, work), arena, parts);
    if (work.kind == WorkKind::kPrimary || work.kind == WorkKind::kShadow) {
        paper_tree = build_paper_tree(scene.topology(), scene.positions);
        tracers.push_back(paper_tracer(paper_tree, work));
    }
    const std::size_t peers = tracers.size();
    for (Tracer& ours : our_tracers(scene.bvh, best_simd_target(), work))
        tracers.push_back(std::move(ours));
    const std::vector<Method> methods = methods_of(tracers, arena, parts);
    const std::vector<Times> times = time_in_turn(methods, parts.size(), rig.repeat);

    for (const std::size_t best :
         fastest_of_groups(std::span(methods).first(peers), std::span(times).first(peers), 1)) {
        const Tracer& peer = tracers[best];
        const TraceAnswers answers = arena.execute([&] {
            peer.trace(work.whole());
            return peer.answers();
        });
        for (std::size_t i = peers; i < tracers.size(); ++i) {
            if (!comparable(tracers[i], peer)) continue;
            rig.report.add({name_of(work.kind), Unit::kMrayPerSecond, work.active_count,
                            tracers[i].name, peer.name, times[i], times[best],
                            count_mismatches(work, tracers[i].answers(), answers)});
        }
    }
}

}  // namespace mray::bench
