#include "lab/accuracy/chart_methods.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "cpu/image/tile_tracer.h"
#include "cpu/reference/scalar_tracer.h"
#include "lab/methods/paper_2007.h"
#include "lab/methods/report.h"
#include "lab/methods/rules.h"
#ifdef MORPHRAY_EMBREE
#include "lab/methods/embree.h"
#endif

namespace mray::lab {

struct ChartMethods::Peers {
    explicit Peers(const ChartScene& scene)
        : tree(build_paper_tree(scene.topology, scene.scene_space.positions)) {
        refit(tree, scene.topology, scene.world_space.positions);
#ifdef MORPHRAY_EMBREE
        devices.emplace_back(0, "");
        embree = embree_variants(devices, scene.topology, scene.world_space.positions);
#endif
    }

    /// In world space; of the method of 2007 and of the rules.
    PeerTree tree;
#ifdef MORPHRAY_EMBREE
    std::vector<EmbreeDevice> devices;
    std::vector<EmbreeVariant> embree;
#endif
};

namespace {

/// Brute force traces as many tiles as take about this many tests of triangles.
constexpr std::size_t kBruteTests = 20'000'000;

Tracer brute_tracer(const ChartScene& scene, const RaySet& set) {
    using Brute = cpu::OneByOne<cpu::BruteTracer>;
    const cpu::BruteTracer brute(scene.topology, scene.scene_space.positions);
    return batch_tracer("brute force", RaysAtOnce::kStream, std::make_shared<const Brute>(brute),
                        set);
}

Tracer device_tracer(const ChartDevice& device, const RaySet& set) {
    const auto answers = std::make_shared<TraceAnswers>(set);
    return {.name = device.name,
            .trace =
                [backend = device.backend, answers, &set](const TileRange& range) {
                    if (range.begin == range.end) return;
                    const std::size_t first = set.tiles[range.begin].begin;
                    const std::size_t count = set.tiles[range.end - 1].end - first;
                    const auto some = [&](auto& all) {
                        return std::span(all).subspan(all.empty() ? 0 : first,
                                                      all.empty() ? 0 : count);
                    };
                    backend->trace({std::span(set.rays).subspan(first, count), some(answers->hits),
                                    some(answers->occluded)});
                },
            .answers = [answers] { return *answers; }};
}

/// "packets" for "packet", "light packets" for shadow rays.
std::string name_of_ours(const Tracer& tracer, RayKind kind) {
    if (tracer.name == "single") return tracer.name;
    return fmt::format("{}{}s", kind == RayKind::kShadow && tracer.name == "packet" ? "light " : "",
                       tracer.name);
}

}  // namespace

ChartMethods::ChartMethods(const ChartScene& scene, std::vector<ChartDevice> devices)
    : scene_(scene), devices_(std::move(devices)), peers_(std::make_unique<Peers>(scene)) {
    for (const ChartDevice& device : devices_)
        device.backend->set_scene(scene.topology, scene.scene_space.positions,
                                  scene.scene_space.bvh);
}

ChartMethods::~ChartMethods() = default;

std::vector<ChartTracer> ChartMethods::operator()(const ChartRays& rays) const {
    const RaySet& ours = rays.scene_space;
    const RaySet& theirs = rays.world_space;
    std::vector<ChartTracer> tracers;
    const auto add = [&](std::string method, std::string family, bool in_scene_space, bool slow,
                         Tracer tracer) {
        tracers.push_back({std::move(method), std::move(family), in_scene_space, slow, ours.whole(),
                           std::move(tracer)});
    };
    const Bvh& bvh = scene_.scene_space.bvh;
    add("brute force", "ours", true, true, brute_tracer(scene_, ours));
    const std::size_t tile_tests =
        std::max<std::size_t>(1, scene_.topology.triangles.size()) * kTileSize * kTileSize;
    // Where most rays are.
    const std::vector<TileRays>& tiles = ours.tiles;
    const auto rays_of = [&](const TileRays& tile) {
        return std::accumulate(ours.active.begin() + static_cast<std::ptrdiff_t>(tile.begin),
                               ours.active.begin() + static_cast<std::ptrdiff_t>(tile.end),
                               std::size_t{0});
    };
    const auto fullest = std::ranges::max_element(tiles, {}, rays_of);
    const auto first = static_cast<std::size_t>(fullest - tiles.begin());
    const std::size_t count = std::max<std::size_t>(1, kBruteTests / tile_tests);
    tracers.back().tiles = {first, std::min(tiles.size(), first + count)};
    add("scalar", "ours", true, true, reference_tracer(bvh, ours));
    for (Tracer& tracer : our_tracers(bvh, best_simd_target(), ours)) {
        const bool slow = tracer.name != "packet";
        std::string name = name_of_ours(tracer, ours.kind);
        add(std::move(name), "ours", true, slow, std::move(tracer));
    }
    for (const ChartDevice& device : devices_)
        add(device.name, "Vulkan", true, true, device_tracer(device, ours));
    if (ours.in_packets())
        add("2007 packets", "2007", false, false, paper_tracer(peers_->tree, theirs));
#ifdef MORPHRAY_EMBREE
    for (Tracer& tracer : embree_peers(peers_->embree, theirs)) {
        // "Intersect16 robust MEDIUM all"
        const bool one = tracer.name.find("1 ") != std::string::npos;
        if (!one && tracer.name.find("16 ") == std::string::npos) continue;
        if (one && tracer.at_once != RaysAtOnce::kOne) continue;
        const char* const mode =
            tracer.name.find("robust") < tracer.name.size() ? "robust" : "fast";
        const char* const tree = tracer.name.find("HIGH") < tracer.name.size() ? "HIGH" : "MEDIUM";
        add(fmt::format("Embree {} {} {}", one ? "1" : "16", mode, tree),
            fmt::format("Embree {}", mode), false, false, std::move(tracer));
    }
#endif
    for (Tracer& tracer : rule_tracers(peers_->tree, theirs)) {
        std::string name = "rule " + tracer.name;
        add(std::move(name), "rules", false, true, std::move(tracer));
    }
    return tracers;
}

std::string embree_name() {
#ifdef MORPHRAY_EMBREE
    return "Embree " + embree_version(EmbreeDevice(0, ""));
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
                points.push_back({kind, one.method, one.family, one.in_scene_space, {}});
        for (std::size_t turn = 0; turn < tracers.size(); ++turn) {
            const std::size_t at = (turn + chunk) % tracers.size();
            const ChartTracer& one = tracers[at];
            if (one.slow && chunk >= effort.slow_chunks) continue;
            // To warm up.
            one.tracer.trace({one.tiles.begin, std::min(one.tiles.begin + 2, one.tiles.end)});
            const double ms = timed([&] { one.tracer.trace(one.tiles); });
            const Judge& judge = one.in_scene_space ? our_judge : their_judge;
            Score score = judge.score(one.tracer.answers(), one.tiles);
            score.ms = ms;
            score.mrays.push_back(score.mrays_per_second());
            points[at].score += score;
        }
        done();
    }
    return points;
}

}  // namespace mray::lab
