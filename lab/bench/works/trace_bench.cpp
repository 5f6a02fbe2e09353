#include <algorithm>
#include <optional>

#include "common/base/thread_arena.h"
#include "lab/bench/paper_2007/work_tracer.h"
#include "lab/bench/peer.h"
#include "lab/bench/works/ours.h"
#include "lab/bench/works/works.h"

namespace mray::bench {
namespace {

// An image of 1024 x 1024 has 16 parts on one thread, and half as many on two: a fifth of a
// millisecond of our fastest tracer, which is long compared with the clock and the start of tasks,
// and short compared with most disturbances.
constexpr std::size_t kSquaresOfPart = 16;
// Every method traces each n-th part a few times to find out which peers are the fastest.
constexpr std::size_t kTrialStride = 4;
constexpr int kTrialRounds = 2;
// Peers of each group that are measured in full, because a short trial may take the wrong one.
constexpr std::size_t kFinalists = 2;

struct Mine {
    const OurTracer* tracer;
    TraceAnswers answers;
};

std::vector<Mine> tracers_for(const std::vector<OurTracer>& tracers, const TraceWork& work) {
    std::vector<Mine> mine;
    for (const OurTracer& tracer : tracers) {
        const auto& works = tracer.works;
        if (std::find(works.begin(), works.end(), work.kind) == works.end()) continue;
        mine.push_back({&tracer, TraceAnswers(work)});
    }
    return mine;
}

/// The paper's tracer for primary and shadow rays, in a group of its own.
class PaperPeer {
public:
    PaperPeer(const BenchScene& scene, const TraceWork& work)
        : tree_(paper_2007::build_sweep_tree(scene.topology(), scene.positions)),
          tracer_(tree_, work) {}

    /// This object outlives the peer.
    Peer peer() {
        return {.name = "paper-2007",
                .group = "paper-2007",
                .one_ray = false,
                .trace = [this](const WorkPart& part) { tracer_.trace(part); },
                .answers = [this] { return tracer_.answers(); }};
    }

private:
    paper_2007::Tree tree_;
    paper_2007::WorkTracer tracer_;
};

PartMethod method_of(const Peer& peer, ThreadArena& arena, std::span<const WorkPart> parts) {
    return {peer.name, {}, [&peer, &arena, parts](std::size_t part) {
                arena.execute([&] { peer.trace(parts[part]); });
            }};
}

/// The fastest peers of each group by a short trial.
std::vector<Peer> finalists_of(std::vector<Peer> peers, ThreadArena& arena,
                               std::span<const WorkPart> all_parts) {
    std::vector<WorkPart> parts;
    for (std::size_t i = 0; i < all_parts.size(); i += kTrialStride) parts.push_back(all_parts[i]);
    std::vector<PartMethod> methods;
    for (const Peer& peer : peers) methods.push_back(method_of(peer, arena, parts));
    const std::vector<Times> times = time_parts(methods, parts.size(), kTrialRounds);
    std::vector<Peer> finalists;
    for (const std::size_t i : fastest_of_groups(peers, times, kFinalists))
        finalists.push_back(std::move(peers[i]));
    return finalists;
}

/// Whether both take rays in a similar way: packets are not compared with calls of one ray, nor
/// such calls with packets.
bool comparable(const OurTracer& tracer, const Peer& peer) {
    return tracer.at_once == RaysAtOnce::kStream ||
           (tracer.at_once == RaysAtOnce::kOne) == peer.one_ray;
}

TraceAnswers answers_of(const Peer& peer, ThreadArena& arena, const TraceWork& work) {
    return arena.execute([&] {
        peer.trace(work.whole());
        return peer.answers();
    });
}

}  // namespace

void bench_trace(const Rig& rig, const BenchScene& scene, const EmbreeScenes& embree,
                 const TraceWork& work) {
    ThreadArena arena(rig.threads);
    const std::vector<OurTracer> tracers = our_tracers(scene.bvh, rig.targets);
    std::vector<Mine> mine = tracers_for(tracers, work);
    const std::vector<WorkPart> parts =
        work.parts(work.squares.size() / (kSquaresOfPart * static_cast<std::size_t>(rig.threads)));

    std::vector<Peer> peers = finalists_of(embree_peers(embree, work), arena, parts);
    std::optional<PaperPeer> paper;
    if (work.kind == WorkKind::kPrimary || work.kind == WorkKind::kShadow)
        peers.push_back(paper.emplace(scene, work).peer());

    std::vector<PartMethod> methods;
    for (Mine& m : mine) {
        methods.push_back({m.tracer->name, {}, [&](std::size_t part) {
                               arena.execute(
                                   [&] { m.tracer->trace_part(work, parts[part], m.answers); });
                           }});
    }
    for (const Peer& peer : peers) methods.push_back(method_of(peer, arena, parts));
    const std::vector<Times> times = time_parts(methods, parts.size(), rig.repeat);
    const std::span<const Times> peer_times = std::span(times).subspan(mine.size());

    for (Mine& m : mine) {
        if (m.tracer->in_image_order && !work.any_hit()) to_ray_order(work, m.answers.hits);
    }
    for (const std::size_t best : fastest_of_groups(peers, peer_times, 1)) {
        const TraceAnswers theirs = answers_of(peers[best], arena, work);
        for (std::size_t i = 0; i < mine.size(); ++i) {
            if (!comparable(*mine[i].tracer, peers[best])) continue;
            Row row = row_of(rig, scene, work, theirs);
            row.tracer = mine[i].tracer->name;
            row.target = mine[i].tracer->target;
            row.peer = peers[best].name;
            row.mismatches = compare_answers(work, mine[i].answers, theirs);
            set_times(row, times[i], peer_times[best], Unit::kMrayPerSecond, work.active_count);
            rig.report(row);
        }
    }
}

}  // namespace mray::bench
