#include "lab/accuracy/chart_methods.h"

#include <fmt/format.h>

#include "common/scene/pose.h"
#include "cpu/image/tile_tracer.h"
#include "cpu/reference/scalar_tracer.h"
#include "lab/methods/paper_2007.h"
#include "lab/methods/report.h"
#include "lab/methods/rules.h"
#ifdef MORPHRAY_EMBREE
#include "lab/methods/embree.h"
#endif

namespace mray::lab {
namespace {

struct Peers {
    explicit Peers(const ChartScene& scene)
        : pose(scene.scene_space.positions),
          tree(build_paper_tree(scene.topology, scene.scene_space.positions)),
          gpu_tree(build_peer_tree(scene.topology, scene.scene_space.positions, 1.5, 4)) {
        refit(tree, scene.topology, scene.world_space.positions);
        refit(gpu_tree, scene.topology, scene.world_space.positions);
#ifdef MORPHRAY_EMBREE
        devices.emplace_back(0, "");
        embree = embree_variants(devices, scene.topology, scene.world_space.positions);
#endif
    }

    /// Devices borrow it.
    Pose pose;
    /// In world space, for the method of 2007 and the rules.
    PeerTree tree;
    PeerTree gpu_tree;
#ifdef MORPHRAY_EMBREE
    std::vector<EmbreeDevice> devices;
    std::vector<EmbreeVariant> embree;
#endif
};

/// As many tiles as take brute force about 2 * 10^7 tests of triangles, where most rays are.
TileRange brute_tiles(const ChartScene& scene, const RaySet& set) {
    const auto rays_of = [&](const TileRays& tile) {
        return std::ranges::count(std::span(set.active).subspan(tile.begin, tile.end - tile.begin),
                                  1);
    };
    const std::size_t first = static_cast<std::size_t>(
        std::ranges::max_element(set.tiles, {}, rays_of) - set.tiles.begin());
    const std::size_t tile_tests = (scene.topology.triangles.size() + 1) * kTileSize * kTileSize;
    const std::size_t count = std::max<std::size_t>(1, 20'000'000 / tile_tests);
    return {first, std::min(set.tiles.size(), first + count)};
}

Tracer device_tracer(const std::function<void(const RayBatch&)>& trace, const RaySet& set) {
    const auto answers = std::make_shared<TraceAnswers>(set);
    return {.name = "",
            .trace =
                [trace, answers, &set](const TileRange& range) {
                    if (range.begin == range.end) return;
                    const std::size_t first = set.tiles[range.begin].begin;
                    const std::size_t count = set.tiles[range.end - 1].end - first;
                    const auto some = [&](auto& all) {
                        return std::span(all).subspan(all.empty() ? 0 : first,
                                                      all.empty() ? 0 : count);
                    };
                    trace({std::span(set.rays).subspan(first, count), some(answers->hits),
                           some(answers->occluded)});
                },
            .answers = [answers] { return *answers; }};
}

}  // namespace

MakeTracers chart_methods(const ChartScene& scene, const std::vector<ChartDevice>& devices) {
    const auto peers = std::make_shared<const Peers>(scene);
    for (const ChartDevice& device : devices)
        device.backend->set_scene(scene.topology, peers->pose, scene.scene_space.bvh);
    return [&scene, devices, peers](const ChartRays& rays) {
        const RaySet& ours = rays.scene_space;
        const RaySet& theirs = rays.world_space;
        std::vector<ChartTracer> tracers;
        const auto add = [&](std::string method, std::string family, bool slow,
                             const Tracer& tracer) {
            tracers.push_back({std::move(method), std::move(family), slow, tracer, ours.whole()});
        };
        using Brute = cpu::OneByOne<cpu::BruteTracer>;
        const cpu::BruteTracer brute(scene.topology, scene.scene_space.positions);
        add("brute force", "ours", true,
            batch_tracer("", RaysAtOnce::kStream, std::make_shared<const Brute>(brute), ours));
        tracers.back().tiles = brute_tiles(scene, ours);
        add("scalar", "ours", true, reference_tracer(scene.scene_space.bvh, ours));
        for (const Tracer& tracer : our_tracers(scene.scene_space.bvh, best_simd_target(), ours)) {
            const bool packets = tracer.name == "packet";
            const bool light = packets && ours.kind == RayKind::kShadow;
            add(fmt::format("{}{}{}", light ? "light " : "", tracer.name,
                            tracer.name == "single" ? "" : "s"),
                "ours", !packets, tracer);
        }
        for (const ChartDevice& device : devices) {
            const auto trace = [backend = device.backend](const RayBatch& to) {
                backend->trace(to);
            };
            add("Vulkan " + device.name, "Vulkan", true, device_tracer(trace, ours));
            // The peer's kernel for rays in memory finds closest hits only.
            if (theirs.any_hit() || peers->gpu_tree.nodes.size() < 2) continue;
            const auto find_hits = [peer = device.make_peer(peers->gpu_tree, theirs.rays.size())](
                                       const RayBatch& to) { peer(to.rays, to.hits); };
            add("GPU peer " + device.name, "GPU peer", true, device_tracer(find_hits, theirs));
        }
        if (ours.in_packets())
            add("2007 packets", "2007", false, paper_tracer(peers->tree, theirs));
#ifdef MORPHRAY_EMBREE
        for (const Tracer& tracer : embree_peers(peers->embree, theirs)) {
            // "Intersect16 robust MEDIUM all" without "Intersect". Calls take one ray or 16.
            const std::string name = tracer.name.substr(tracer.name.find_first_of("123456789"));
            if (tracer.at_once != RaysAtOnce::kOne && !name.starts_with("16 ")) continue;
            const bool robust = name.find("robust") != std::string::npos;
            add("Embree " + name.substr(0, name.rfind(' ')),
                robust ? "Embree robust" : "Embree fast", false, tracer);
        }
#endif
        for (const Tracer& tracer : rule_tracers(peers->tree, theirs))
            add("rule " + tracer.name, "rules", true, tracer);
        return tracers;
    };
}

bool in_scene_space(const std::string& family) { return family == "ours" || family == "Vulkan"; }

std::string embree_name() {
#ifdef MORPHRAY_EMBREE
    return "Embree " RTC_VERSION_STRING;
#else
    return "without Embree";
#endif
}

std::vector<ChartPoint> measure(const ChartScene& scene, const MakeTracers& make_tracers,
                                RayKind kind, const Effort& effort,
                                const std::function<void()>& done) {
    const ExactReferee our_referee(scene.topology, scene.scene_space.positions,
                                   scene.scene_space.bvh);
    const ExactReferee their_referee(scene.topology, scene.world_space.positions,
                                     scene.world_space.bvh);
    std::vector<ChartPoint> points;
    for (std::size_t chunk = 0; chunk < effort.chunks; ++chunk) {
        ChartRays rays{make_chart_rays(scene, kind, chunk, effort.chunk_rays), {}};
        rays.world_space = to_world(rays.scene_space, scene.space);
        const Judge our_judge(our_referee, rays.scene_space);
        const Judge their_judge(their_referee, rays.world_space);
        const std::vector<ChartTracer> tracers = make_tracers(rays);
        if (points.empty())
            for (const ChartTracer& one : tracers)
                points.push_back({kind, one.method, one.family, {}});
        std::vector<std::vector<double>> times(tracers.size());
        for (std::size_t turn = 0; turn < effort.rounds * tracers.size(); ++turn) {
            const std::size_t at = (turn + chunk) % tracers.size();
            const ChartTracer& one = tracers[at];
            // Slow methods take chunks from all of the run.
            if (one.slow && chunk % (effort.chunks / effort.slow_chunks) != 0) continue;
            // To warm up.
            one.tracer.trace({one.tiles.begin, std::min(one.tiles.begin + 2, one.tiles.end)});
            times[at].push_back(timed([&] { one.tracer.trace(one.tiles); }));
            if (times[at].size() < effort.rounds) continue;
            const Judge& judge = in_scene_space(one.family) ? our_judge : their_judge;
            Score score = judge.score(one.tracer.answers(), one.tiles);
            for (const double ms : times[at]) {
                score.ms = ms;
                if (score.rays > 0) score.mrays.push_back(score.mrays_per_second());
            }
            score.ms = median(times[at]);
            points[at].score += score;
        }
        done();
    }
    return points;
}

}  // namespace mray::lab
