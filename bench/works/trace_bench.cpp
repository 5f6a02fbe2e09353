#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "bench/embree/embree_tracer.h"
#include "bench/paper_2007/work_tracer.h"
#include "bench/works/ours.h"
#include "bench/works/works.h"
#include "common/base/thread_arena.h"

namespace mray::bench {
namespace {

struct Mine {
    const OurTracer* tracer;
    TraceAnswers answers;
};

/// The fastest tracer of each group is the peer of a row.
struct Peer {
    std::string name;
    int group;
    std::function<void()> prepare;
    std::function<void()> trace;
    /// The answers of the last trace.
    std::function<TraceAnswers()> answers;
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

/// Embree's ways over its best trees, and the records of their rays.
class EmbreePeers {
public:
    EmbreePeers(const Rig& rig, const BenchScene& scene)
        : mesh_(scene.topology(), scene.positions),
          medium_(rig.device, mesh_, EmbreeTree::kMedium),
          high_(rig.device, mesh_, EmbreeTree::kHigh) {}

    /// This object outlives the peers.
    std::vector<Peer> peers_for(const TraceWork& work) {
        std::vector<Peer> peers;
        for (const EmbreeWay& way : embree_ways(work.params.rays)) {
            records_.push_back(way.make(work));
            EmbreeTracer& tracer = *records_.back();
            const auto add = [&](const char* tree, const EmbreeScene& scene) {
                peers.push_back({fmt::format("Embree {} ({})", way.name, tree), way.group,
                                 [&tracer] { tracer.reset(); },
                                 [&tracer, &scene] { tracer.trace(scene); },
                                 [&tracer] { return tracer.answers(); }});
            };
            add("MEDIUM", medium_);
            add("HIGH", high_);
        }
        return peers;
    }

private:
    EmbreeMesh mesh_;
    EmbreeScene medium_;
    EmbreeScene high_;
    std::vector<std::unique_ptr<EmbreeTracer>> records_;
};

/// The paper's tracer for primary and shadow rays, in a group of its own.
class PaperPeer {
public:
    PaperPeer(const BenchScene& scene, const TraceWork& work)
        : tree_(paper_2007::build_sweep_tree(scene.topology(), scene.positions)),
          tracer_(tree_, work) {}

    /// This object outlives the peer.
    Peer peer() {
        return {"paper-2007", -1, [] {}, [this] { tracer_.trace(); },
                [this] { return tracer_.answers(); }};
    }

private:
    paper_2007::Tree tree_;
    paper_2007::WorkTracer tracer_;
};

}  // namespace

void bench_trace(const Rig& rig, const BenchScene& scene, const TraceWork& work) {
    ThreadArena arena(rig.threads);
    const std::vector<OurTracer> tracers = our_tracers(scene.bvh, rig.targets);
    std::vector<Mine> mine = tracers_for(tracers, work);

    EmbreePeers embree(rig, scene);
    std::vector<Peer> peers = embree.peers_for(work);
    std::optional<PaperPeer> paper;
    if (work.params.rays != kRaysAo) peers.push_back(paper.emplace(scene, work).peer());

    std::vector<Method> methods;
    methods.reserve(mine.size() + peers.size());
    for (Mine& m : mine) {
        methods.push_back({m.tracer->name, {}, [&] {
                               arena.execute([&] { m.tracer->trace(work, m.answers); });
                           }});
    }
    for (const Peer& peer : peers) {
        methods.push_back({peer.name, [&] { arena.execute([&] { peer.prepare(); }); },
                           [&] { arena.execute([&] { peer.trace(); }); }});
    }
    const std::vector<Samples> samples = time_interleaved(methods, rig.repeat);
    const std::span<const Samples> peer_samples = std::span(samples).subspan(mine.size());

    for (Mine& m : mine) {
        if (m.tracer->in_image_order && !work.any_hit()) to_ray_order(work, m.answers.hits);
    }
    for (const std::size_t best : best_of_groups(peers, peer_samples)) {
        methods[mine.size() + best].prepare();
        methods[mine.size() + best].run();
        const TraceAnswers theirs = peers[best].answers();
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

}  // namespace mray::bench
