#include <algorithm>
#include <memory>

#include "bench/embree_tracer.h"
#include "bench/ours.h"
#include "bench/works.h"
#include "common/thread_arena.h"

namespace morphray::bench {
namespace {

struct Mine {
    const OurTracer* tracer;
    TraceAnswers answers;
};

/// One of Embree's ways over one of its trees. Its answers are kept from the warm-up on, since
/// records are shared between the trees.
struct Peer {
    std::string name;
    int group;
    EmbreeTracer* tracer;
    const EmbreeScene* scene;
};

std::vector<Mine> tracers_for(const std::vector<OurTracer>& tracers, const TraceWork& work) {
    std::vector<Mine> mine;
    for (const OurTracer& tracer : tracers) {
        const auto& works = tracer.works;
        if (std::find(works.begin(), works.end(), work.params.rays) == works.end()) continue;
        mine.push_back({&tracer, TraceAnswers(work)});
    }
    return mine;
}

/// The index of the peer with the smallest median in each group.
std::vector<std::size_t> best_of_groups(const std::vector<Peer>& peers,
                                        std::span<const Samples> samples) {
    std::vector<std::size_t> best;
    for (std::size_t i = 0; i < peers.size(); ++i) {
        const auto rival = std::find_if(best.begin(), best.end(), [&](std::size_t b) {
            return peers[b].group == peers[i].group;
        });
        if (rival == best.end()) {
            best.push_back(i);
        } else if (median(samples[i]) < median(samples[*rival])) {
            *rival = i;
        }
    }
    return best;
}

}  // namespace

void bench_trace(const Rig& rig, const BenchScene& scene, const TraceWork& work) {
    ThreadArena arena(rig.threads);
    const std::vector<OurTracer> tracers =
        our_tracers({scene.topology(), scene.positions, scene.bvh}, rig.targets);
    std::vector<Mine> mine = tracers_for(tracers, work);

    const EmbreeMesh mesh(scene.topology(), scene.positions);
    const EmbreeScene medium(rig.device, mesh, EmbreeTree::kMedium);
    const EmbreeScene high(rig.device, mesh, EmbreeTree::kHigh);
    std::vector<std::unique_ptr<EmbreeTracer>> records;
    std::vector<Peer> peers;
    for (const EmbreeWay& way : embree_ways(work.params.rays)) {
        records.push_back(way.make(work));
        EmbreeTracer* tracer = records.back().get();
        peers.push_back({"Embree " + way.name + " (MEDIUM)", way.group, tracer, &medium});
        peers.push_back({"Embree " + way.name + " (HIGH)", way.group, tracer, &high});
    }

    std::vector<Contender> contenders;
    contenders.reserve(mine.size() + peers.size());
    for (Mine& m : mine) {
        contenders.push_back({m.tracer->name, {}, [&] {
                                  arena.execute([&] { m.tracer->trace(work, m.answers); });
                              }});
    }
    for (const Peer& peer : peers) {
        contenders.push_back({peer.name, [&] { arena.execute([&] { peer.tracer->reset(); }); },
                              [&] { arena.execute([&] { peer.tracer->trace(*peer.scene); }); }});
    }
    const std::vector<Samples> samples = time_interleaved(contenders, rig.repeat);
    const std::span<const Samples> peer_samples = std::span(samples).subspan(mine.size());

    for (Mine& m : mine) {
        if (m.tracer->in_picture_order && !work.any_hit()) to_ray_order(work, m.answers.hits);
    }
    for (const std::size_t best : best_of_groups(peers, peer_samples)) {
        contenders[mine.size() + best].prepare();
        contenders[mine.size() + best].run();
        const TraceAnswers theirs = peers[best].tracer->answers();
        for (std::size_t i = 0; i < mine.size(); ++i) {
            Row row = row_of(rig, scene, work, theirs);
            row.tracer = mine[i].tracer->name;
            row.target = mine[i].tracer->target;
            row.peer = peers[best].name;
            row.mismatches = compare_answers(work, mine[i].answers, theirs);
            set_times(row, samples[i], peer_samples[best], Unit::kMrayPerSecond, work.active_count);
            rig.report(row);
        }
    }
}

}  // namespace morphray::bench
