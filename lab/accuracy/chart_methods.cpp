#include "lab/accuracy/chart_methods.h"

#include <fmt/format.h>

#include "common/scene/pose.h"
#include "cpu/reference/scalar_tracer.h"
#include "lab/methods/paper_2007.h"
#include "lab/methods/report.h"
#include "lab/methods/rules.h"
#ifdef MORPHRAY_EMBREE
#include "lab/methods/embree.h"
#endif
#ifdef MORPHRAY_HAS_VULKAN
#include "lab/methods/gpu_peer.h"
#endif

namespace mray::lab {
namespace {

struct Peers {
    explicit Peers(const ChartScene& scene)
        : pose(scene.scene_space.positions),
          gpu_tree(build_peer_tree(scene.topology, scene.scene_space.positions, 1.5, 4)) {
        refit(gpu_tree, scene.topology, scene.world_space.positions);
#ifdef MORPHRAY_EMBREE
        devices.emplace_back(0, "");
        embree = embree_variants(devices, scene.topology, scene.world_space.positions);
#endif
    }

    /// Devices borrow it.
    Pose pose;
    PeerTree gpu_tree;
#ifdef MORPHRAY_EMBREE
    std::vector<EmbreeDevice> devices;
    std::vector<EmbreeScene> embree;
#endif
};

/// As many tiles from the middle as take brute force about 2 * 10^7 tests of triangles.
TileRange brute_tiles(const ChartScene& scene, const RaySet& set) {
    const std::size_t first = set.tiles.size() / 2;
    const std::size_t tile_tests = (scene.topology.triangles.size() + 1) * kTileSize * kTileSize;
    const std::size_t count = std::max<std::size_t>(1, 20'000'000 / tile_tests);
    return {first, std::min(set.tiles.size(), first + count)};
}

#ifdef MORPHRAY_HAS_VULKAN
/// By one call of all rays.
Tracer device_tracer(const std::function<void(const RayBatch&)>& trace, const RaySet& set) {
    const auto answers = std::make_shared<TraceAnswers>(set);
    return {.name = "",
            .trace =
                [trace, answers, &set](const TileRange& range) {
                    if (range.begin == range.end) return;
                    const std::size_t first = set.tiles[range.begin].begin;
                    const std::size_t count = set.tiles[range.end - 1].end - first;
                    RayBatch batch{std::span(set.rays).subspan(first, count)};
                    if (set.any_hit()) {
                        batch.occluded = std::span(answers->occluded).subspan(first, count);
                    } else {
                        batch.hits = std::span(answers->hits).subspan(first, count);
                    }
                    trace(batch);
                },
            .answers = [answers] { return *answers; }};
}
#endif

}  // namespace

std::vector<ChartDevice> open_devices() {
    std::vector<ChartDevice> devices;
#ifdef MORPHRAY_HAS_VULKAN
    try {
        for (const gpu::DeviceInfo& info : gpu::list_devices()) {
            if (!info.unusable.empty()) continue;
            gpu::VulkanConfig config;
            config.device = std::to_string(info.index);
            const auto shared = gpu::open_device(config);
            // Without "(LLVM 15.0.6, 256 bits)"; the footer has all.
            devices.push_back({info.name.substr(0, info.name.find(" (")),
                               fmt::format("{} ({})", info.name, info.driver), shared,
                               gpu::make_backend_on(shared)});
        }
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kUnavailable) throw;
    }
#endif
    return devices;
}

MakeTracers chart_methods(const ChartScene& scene, const std::vector<ChartDevice>& devices) {
    const auto peers = std::make_shared<const Peers>(scene);
    for (const ChartDevice& device : devices)
        device.backend->set_scene(scene.topology, peers->pose, scene.bvh);
    return [&scene, devices, peers](const ChartRays& rays) {
        const RaySet& ours = rays.scene_space;
        const RaySet& theirs = rays.world_space;
        std::vector<Tracer> tracers;
        const auto add = [&](std::string method, const char* family, bool slow, Tracer tracer) {
            tracer.name = std::move(method);
            tracer.group = family;
            tracer.slow = slow;
            tracers.push_back(std::move(tracer));
        };
        using Brute = cpu::OneByOne<cpu::BruteTracer>;
        const cpu::BruteTracer brute(scene.topology, scene.scene_space.positions);
        add("brute force", "ours", true,
            batch_tracer("", RaysAtOnce::kStream, std::make_shared<const Brute>(brute), ours));
        tracers.back().tiles = brute_tiles(scene, ours);
        add("scalar", "ours", true, reference_tracer(scene.bvh, ours));
        for (const Tracer& tracer : our_tracers(scene.bvh, best_simd_target(), ours)) {
            const bool packets = tracer.name == "packet";
            const bool light = packets && ours.kind == RayKind::kShadow;
            add(fmt::format("{}{}{}", light ? "light " : "", tracer.name,
                            tracer.name == "single" ? "" : "s"),
                "ours", !packets, tracer);
        }
#ifdef MORPHRAY_HAS_VULKAN
        for (const ChartDevice& device : devices) {
            const auto trace = [backend = device.backend](const RayBatch& to) {
                backend->trace(to);
            };
            add("Vulkan " + device.name, "Vulkan", true, device_tracer(trace, ours));
            // The peer's kernel for rays in memory finds closest hits only.
            if (theirs.any_hit() || peers->gpu_tree.nodes.size() < 2) continue;
            const auto find_hits =
                [peer = std::make_shared<GpuPeer>(device.device, peers->gpu_tree, ImageParams{},
                                                  theirs.rays.size())](const RayBatch& to) {
                    peer->set_rays(to.rays);
                    peer->trace(kPeerRays);
                    peer->read_hits(to.hits);
                };
            add("GPU peer " + device.name, "GPU peer", true, device_tracer(find_hits, theirs));
        }
#endif
        if (ours.in_packets())
            add("2007 packets", "2007", false, paper_tracer(scene.world_space.tree, theirs));
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
        for (const Tracer& tracer : rule_tracers(scene.world_space.tree, theirs))
            add("rule " + tracer.name, "rules", true, tracer);
        return tracers;
    };
}

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
    const auto& [our_positions, our_tree] = scene.scene_space;
    const auto& [their_positions, their_tree] = scene.world_space;
    const ExactReferee our_referee(scene.topology, our_positions, our_tree);
    const ExactReferee their_referee(scene.topology, their_positions, their_tree);
    std::vector<ChartPoint> points;
    for (std::size_t chunk = 0; chunk < effort.chunks; ++chunk) {
        ChartRays rays{make_chart_rays(scene, kind, chunk, effort.chunk_rays), {}};
        rays.world_space = to_world(rays.scene_space, scene.space);
        const Judge our_judge(our_referee, rays.scene_space);
        const Judge their_judge(their_referee, rays.world_space);
        const std::vector<Tracer> tracers = make_tracers(rays);
        if (points.empty())
            for (const Tracer& one : tracers) points.push_back({one.name, one.group, {}});
        std::vector<std::vector<double>> times(tracers.size());
        for (std::size_t turn = 0; turn < effort.rounds * tracers.size(); ++turn) {
            const std::size_t at = (turn + chunk) % tracers.size();
            const Tracer& one = tracers[at];
            const TileRange tiles = one.tiles.value_or(rays.scene_space.whole());
            // Slow methods take chunks from all of the run.
            if (one.slow && chunk % (effort.chunks / effort.slow_chunks) != 0) continue;
            // To warm up.
            one.trace({tiles.begin, std::min(tiles.begin + 2, tiles.end)});
            times[at].push_back(timed([&] { one.trace(tiles); }));
            if (times[at].size() < effort.rounds) continue;
            const Judge& judge = in_scene_space(one.group) ? our_judge : their_judge;
            Score score = judge.score(one.answers(), tiles);
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
