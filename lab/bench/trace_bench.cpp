#include <algorithm>
#include <memory>

#include "common/simd/simd_target.h"
#include "lab/bench/paper_2007/paper_2007.h"
#include "lab/bench/works.h"

namespace mray::bench {
namespace {

// An image of 1024 x 1024 has 16 parts on one thread, and half as many on two: a fifth of a
// millisecond of our fastest tracer, which is long compared with the clock and the start of tasks,
// and short compared with most disturbances.
constexpr std::size_t kTilesOfPart = 16;
// Every method traces each n-th part a few times to find out which peers are the fastest.
constexpr std::size_t kTrialStride = 4;
constexpr int kTrialRounds = 2;
// Peers of each group that are measured in full, because a short trial may take the wrong one.
constexpr std::size_t kFinalists = 2;

struct Mine {
    OurTracer tracer;
    TraceAnswers answers;
};

std::vector<Mine> tracers_for(const Bvh& bvh, const TraceWork& work) {
    std::vector<Mine> mine;
    for (OurTracer& tracer : our_tracers(bvh, best_simd_target())) {
        if (std::ranges::count(tracer.works, work.kind) > 0)
            mine.push_back({std::move(tracer), TraceAnswers(work)});
    }
    return mine;
}

/// The paper's tracer for primary and shadow rays, in a group of its own.
Peer paper_peer(const BenchScene& scene, const TraceWork& work) {
    const auto tree =
        std::make_shared<const PeerTree>(paper_2007::build_tree(scene.topology(), scene.positions));
    const auto tracer = std::make_shared<paper_2007::WorkTracer>(*tree, work);
    return {.name = "paper-2007",
            .group = "paper-2007",
            .trace = [tree, tracer](const WorkPart& part) { tracer->trace(part); },
            .answers = [tracer] { return tracer->answers(); }};
}

std::vector<Method> methods_of(const std::vector<Peer>& peers, ThreadArena& arena,
                               std::span<const WorkPart> parts) {
    std::vector<Method> methods;
    for (const Peer& peer : peers) {
        const auto run = [&peer, &arena, parts](std::size_t part) {
            return timed_in(arena, [&] { peer.trace(parts[part]); });
        };
        methods.push_back({peer.name, {}, run, peer.group});
    }
    return methods;
}

/// The fastest peers of each group by a short trial.
std::vector<Peer> finalists_of(std::vector<Peer> peers, ThreadArena& arena,
                               std::span<const WorkPart> all_parts) {
    std::vector<WorkPart> parts;
    for (std::size_t i = 0; i < all_parts.size(); i += kTrialStride) parts.push_back(all_parts[i]);
    const std::vector<Method> methods = methods_of(peers, arena, parts);
    const std::vector<Times> times = time_in_turn(methods, parts.size(), kTrialRounds);
    std::vector<Peer> finalists;
    for (const std::size_t i : fastest_of_groups(methods, times, kFinalists))
        finalists.push_back(std::move(peers[i]));
    return finalists;
}

/// Whether both take rays in a similar way: packets are not compared with calls of one ray, nor
/// such calls with packets.
bool comparable(const OurTracer& tracer, const Peer& peer) {
    return tracer.at_once == RaysAtOnce::kStream ||
           (tracer.at_once == RaysAtOnce::kOne) == peer.one_ray;
}

}  // namespace

void bench_trace(const Rig& rig, const BenchScene& scene, const EmbreeScenes& embree,
                 const TraceWork& work) {
    ThreadArena arena(rig.threads);
    std::vector<Mine> mine = tracers_for(scene.bvh, work);
    const std::vector<WorkPart> parts =
        work.parts(work.tiles.size() / (kTilesOfPart * static_cast<std::size_t>(rig.threads)));

    std::vector<Peer> peers = finalists_of(embree_peers(embree, work), arena, parts);
    if (work.kind == WorkKind::kPrimary || work.kind == WorkKind::kShadow)
        peers.push_back(paper_peer(scene, work));

    const std::vector<Method> theirs = methods_of(peers, arena, parts);
    std::vector<Method> methods = theirs;
    for (Mine& m : mine) {
        methods.push_back(
            {m.tracer.name, {}, [&](std::size_t part) {
                 return timed_in(arena, [&] { m.tracer.trace_part(work, parts[part], m.answers); });
             }});
    }
    const std::vector<Times> times = time_in_turn(methods, parts.size(), rig.repeat);

    for (Mine& m : mine) {
        if (m.tracer.in_image_order && !work.any_hit()) to_ray_order(work, m.answers.hits);
    }
    for (const std::size_t best :
         fastest_of_groups(theirs, std::span(times).first(theirs.size()), 1)) {
        const TraceAnswers answers = arena.execute([&] {
            peers[best].trace(work.whole());
            return peers[best].answers();
        });
        for (std::size_t i = 0; i < mine.size(); ++i) {
            if (!comparable(mine[i].tracer, peers[best])) continue;
            Row row{.work = name_of(work.kind),
                    .tracer = mine[i].tracer.name,
                    .peer = peers[best].name};
            row.differences = count_mismatches(work, mine[i].answers, answers);
            set_times(row, times[theirs.size() + i], times[best], Unit::kMrayPerSecond,
                      work.active_count);
            rig.report.add(row);
        }
    }
}

}  // namespace mray::bench
