// Each work measures all methods of morphray side by side with Embree and other peers.
#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include <glm/geometric.hpp>

#include "common/base/thread_arena.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/frame_times.h"
#include "common/interop/constants.h"
#include "common/scene/camera_setup.h"
#include "common/update/tree_updater.h"
#include "common/version.h"
#include "cpu/cpu_backend.h"
#include "cpu/refit/refit.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/options.h"
#include "lab/methods/crossing_peers.h"
#include "lab/methods/embree.h"
#include "lab/methods/paper_2007.h"
#include "lab/methods/report.h"
#include "morphray/morphray.hpp"

namespace mray::lab {
namespace {

/// What each work takes: the same scene and number of threads for both sides.
struct Rig {
    const BenchScene& scene;
    /// One for each instruction set of Embree.
    std::span<const EmbreeDevice> devices;
    ThreadArena& arena;
    int repeat;
    Report& report;

    const Topology& topology() const { return scene.topology(); }
    std::size_t pixels() const { return std::size_t{scene.params.width} * scene.params.height; }

    void compare(const Row& row, std::span<const Method> methods, std::size_t parts = 1) const {
        report.compare(row, methods, parts, repeat);
    }
    /// Rays of the camera that hit something else in the trees of both sides.
    std::uint64_t compare_trees(const Bvh& ours, const EmbreeScene& theirs) const {
        const RaySet& primary = scene.primary;
        return arena.execute([&] {
            const Tracer peer = tile_tracer("", embree_tiles(theirs), primary);
            return count_mismatches(primary, trace_all(reference_tracer(ours, primary), primary),
                                    trace_all(peer, primary));
        });
    }
};

/// Times a work that is not cut into parts; in an arena, or on threads of its own.
template <class Work>
auto timing(Work work) {
    return [work](std::size_t) { return timed(work); };
}
template <class Work>
auto timing(ThreadArena& arena, Work work) {
    return timing([&arena, work] { arena.execute(work); });
}

// A part takes 0.2 ms: long beside clock and start of tasks, short beside disturbances.
constexpr std::size_t kTilesOfPart = 16;
// Every method traces each n-th part a few times to find out which peers are the fastest.
constexpr std::size_t kTrialStride = 4;
constexpr int kTrialRounds = 2;
// Peers of each group that are measured in full, because a short trial may take the wrong one.
constexpr std::size_t kFinalists = 2;

std::vector<Method> methods_of(const std::vector<Tracer>& tracers, ThreadArena& arena,
                               std::span<const TileRange> parts) {
    std::vector<Method> methods;
    for (const Tracer& tracer : tracers) {
        const auto run = [&tracer, &arena, parts](std::size_t part) {
            return timed([&] { arena.execute([&] { tracer.trace(parts[part]); }); });
        };
        methods.push_back({tracer.name, {}, run, tracer.group});
    }
    return methods;
}

std::vector<Tracer> finalists_of(std::vector<Tracer> peers, ThreadArena& arena,
                                 std::span<const TileRange> all_parts) {
    std::vector<TileRange> parts;
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

/// Returns when all threads of the arena run in it, or after 2 ms.
void wake_up(ThreadArena& arena) {
    const Stopwatch watch;
    std::atomic<int> awake = 0;
    arena.execute([&] {
        tbb::parallel_for(
            0, arena.threads(),
            [&](int) {
                ++awake;
                while (awake < arena.threads() && watch.ms() < 2) {
                }
            },
            tbb::simple_partitioner());
    });
}

constexpr std::size_t kMostFrames = 12;
constexpr double kFrameStep = 2;

struct Played {
    explicit Played(const BenchScene& of) : scene(of), params(of.params) {
        params.rays = kRaysShadow;
        for (double frame = scene.animation->first_frame();
             frame <= scene.animation->last_frame() && poses.size() < kMostFrames;
             frame += kFrameStep)
            poses.push_back(positions_at(scene, frame));
    }

    const Topology& topology() const { return scene.topology(); }
    /// Traces and shades an image, in the calling thread's arena.
    void trace(const cpu::ImageTracer& tracer, std::size_t number, Frame& frame) const {
        const cpu::ShadedMesh mesh{&topology(), poses[number]};
        const cpu::ImageTiles tiles(params.width, params.height, kTileSize);
        tbb::parallel_for(std::uint32_t{0}, tiles.count(), [&](std::uint32_t i) {
            tracer.trace_tile(mesh, params, tiles[i], frame, {});
        });
    }

    const BenchScene& scene;
    ImageParams params;
    std::vector<std::vector<vec3>> poses;
};

/// Brings a tree to a frame and traces its image; returns the milliseconds that it took.
using PlayFrame = std::function<double(std::size_t number, Frame& frame)>;

PlayFrame our_frames(const Played& played, ThreadArena& arena) {
    const auto pose = std::make_shared<Pose>(played.poses.front());
    const std::shared_ptr<Backend> backend = cpu::make_cpu_backend({.threads = arena.threads()});
    const auto updater = std::make_shared<TreeUpdater>(
        played.topology(), *pose, *backend,
        make_update_policy({.kind = PolicyKind::kAuto},
                           {.first_per_visit = backend->info().trace_per_visit}),
        BuildConfig{.threads = arena.threads()}, UpdateConfig{});
    return [pose, backend, updater, &played, &arena](std::size_t number, Frame& frame) {
        return timed([&] {
            arena.execute([&] { pose->move_to(played.poses[number]); });
            updater->update();
            backend->trace_image(played.params, frame);
            updater->frame_done({.ms = backend->finish().trace_ms, .rays = backend->finish().rays});
        });
    };
}

/// Its positions are written to the mesh before the time begins. Shades by our code.
PlayFrame embree_frames(const Played& played, const EmbreeDevice& device, RTCBuildQuality quality,
                        ThreadArena& arena) {
    const auto scene =
        std::make_shared<EmbreeScene>(device, played.topology(), played.poses.front(), quality);
    scene->commit();
    return
        [&played, &arena, scene, tracer = embree_tiles(*scene)](std::size_t number, Frame& frame) {
            scene->set_positions(played.poses[number]);
            return timed([&] {
                scene->commit();
                arena.execute([&] { played.trace(*tracer, number, frame); });
            });
        };
}

/// Does the work that others do between rays.
struct NoTracer final : cpu::ImageTracer {
    NoTracer() : ImageTracer(best_simd_target()) {}

    void intersect(std::span<const Ray>, std::span<Hit>) const override {}
    void occluded(std::span<const Ray>, std::span<std::uint8_t>) const override {}
    void occluded_shared_origin(vec3, std::span<const cpu::SharedOriginRays>,
                                std::span<std::uint8_t> occluded,
                                const cpu::TileCounts&) const override {
        std::ranges::fill(occluded, std::uint8_t{0});
    }
};

/// Its packets are made before the time begins. Our code makes shadow rays and shades.
PlayFrame paper_frames(const Played& played, ThreadArena& arena) {
    const RaySet& primary = played.scene.primary;
    const auto tree =
        std::make_shared<PeerTree>(build_peer_tree(played.topology(), played.poses.front()));
    return [&played, &primary, &arena, tree, camera = paper_tracer(*tree, primary),
            shader = std::make_shared<const NoTracer>()](std::size_t number, Frame& frame) {
        const double to_hits_ms = timed([&] {
            arena.execute([&] {
                refit(*tree, played.topology(), played.poses[number]);
                camera.trace(primary.whole());
            });
        });
        const AlignedVector<Hit> hits = camera.answers().hits;
        std::size_t ray = 0;
        for (const TileRays& tile : primary.tiles) {
            for_each_pixel(tile.tile, [&](std::uint32_t x, std::uint32_t y) {
                frame.hits[std::size_t{y} * frame.width + x] = hits[ray++];
            });
        }
        frame.has_hits = true;
        const RaySet shadow = make_secondary_rays(
            primary, hits, {&played.topology(), played.poses[number]}, RayKind::kShadow);
        const Tracer light = paper_tracer(*tree, shadow);
        return to_hits_ms + timed([&] {
                   arena.execute([&] {
                       light.trace(shadow.whole());
                       played.trace(*shader, number, frame);
                   });
               });
    };
}

/// Scene space as the world of the library's users, with bounds that make both the same.
constexpr double kExtent = kSceneExtent;
const morphray::Box kBounds{{-kExtent, -kExtent, -kExtent}, {kExtent, kExtent, kExtent}};
/// Distances that differ by more than this part of the scene's extent count as different.
constexpr double kMostDifference = 1e-6;

std::span<const morphray::Vec3> to_user(std::span<const vec3> points) {
    static_assert(sizeof(morphray::Vec3) == sizeof(vec3));
    return {reinterpret_cast<const morphray::Vec3*>(points.data()), points.size()};
}

morphray::Scene user_scene(const Rig& rig, std::span<const vec3> positions) {
    return morphray::Scene::build(
        {.positions = morphray::packed(to_user(positions)),
         .triangles = {&rig.topology().triangles.data()->x, 3 * rig.topology().triangles.size()}},
        morphray::Device::cpu({.threads = rig.arena.threads()}),
        {.bounds = kBounds, .update = morphray::Refit{}});
}

/// By every suitable tracer, against each group of Embree's ways: the fastest of a trial.
void bench_trace(const Rig& rig, std::span<const EmbreeScene> embree, const RaySet& set) {
    const std::vector<TileRange> parts = set.ranges(
        set.tiles.size() / (kTilesOfPart * static_cast<std::size_t>(rig.arena.threads())));
    PeerTree paper_tree;
    std::vector<Tracer> tracers = finalists_of(embree_peers(embree, set), rig.arena, parts);
    if (set.in_packets()) {
        paper_tree = build_peer_tree(rig.topology(), rig.scene.positions);
        tracers.push_back(paper_tracer(paper_tree, set));
    }
    const std::size_t peers = tracers.size();
    std::ranges::move(our_tracers(rig.scene.bvh, best_simd_target(), set),
                      std::back_inserter(tracers));
    const std::vector<Method> methods = methods_of(tracers, rig.arena, parts);
    const std::vector<Times> times = time_in_turn(methods, parts.size(), rig.repeat);

    for (const std::size_t best :
         fastest_of_groups(std::span(methods).first(peers), std::span(times).first(peers), 1)) {
        const Tracer& peer = tracers[best];
        const TraceAnswers answers = rig.arena.execute([&] { return trace_all(peer, set); });
        for (std::size_t i = peers; i < tracers.size(); ++i) {
            if (!comparable(tracers[i], peer)) continue;
            rig.report.add({name_of(set.kind), kMrayPerSecond, set.active_count, tracers[i].name,
                            peer.name, times[i], times[best],
                            count_mismatches(set, tracers[i].answers(), answers)});
        }
    }
}

void bench_refit(const Rig& rig) {
    Bvh bvh = rig.scene.bvh;
    std::vector<vec3> positions = rig.scene.positions;
    // The two frames in turn; the last round has the moved one.
    const auto frame = [&](int round) -> const std::vector<vec3>& {
        return (rig.repeat - 1 - round) % 2 == 0 ? rig.scene.moved : rig.scene.positions;
    };
    // Of all triangles and of few.
    std::deque<std::array<EmbreeScene, 2>> theirs;
    Topology few = rig.topology();
    few.triangles.resize(std::min<std::size_t>(20000, few.triangles.size()));
    // A refit has to write as many bytes as the tree's nodes and leaves have.
    const std::vector<std::byte> from(bvh.nodes.size() * sizeof(Node) +
                                      bvh.leaves.size() * sizeof(Leaf));
    std::vector<std::byte> to(from.size());
    const auto copy = [&] {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, from.size(), 64 * 1024),
                          [&](const auto& range) {
                              std::memcpy(&to[range.begin()], &from[range.begin()], range.size());
                          });
    };

    // Positions are copied and threads woken outside the timing, as moving vertices would do.
    std::vector<Method> methods;
    methods.push_back({"levels",
                       [&](int round) {
                           std::ranges::copy(frame(round), positions.begin());
                           wake_up(rig.arena);
                       },
                       timing(rig.arena, [&] { cpu::refit(bvh, positions); })});
    for (const EmbreeDevice& device : rig.devices) {
        const auto make = [&](const Topology& topology) {
            return EmbreeScene(device, topology, rig.scene.positions, RTC_BUILD_QUALITY_REFIT);
        };
        auto& [all, some] = theirs.emplace_back(std::array{make(rig.topology()), make(few)});
        all.commit();
        methods.push_back({fmt::format("REFIT, {}", device.isa),
                           [&frame, &all = all, &some = some](int round) {
                               all.set_positions(frame(round));
                               // Small refits keep Embree's threads awake.
                               for (int i = 0; i < 2; ++i) some.commit();
                           },
                           timing([&all = all] { all.commit(); }), "Embree",
                           [&, &all = all] { return rig.compare_trees(bvh, all); }});
    }
    methods.push_back(
        {"memcpy", [&](int) { wake_up(rig.arena); }, timing(rig.arena, copy), "memcpy"});
    rig.compare({"refit", kNs, rig.topology().triangles.size()}, methods);
}

void bench_build(const Rig& rig) {
    Bvh mine;
    std::deque<std::optional<EmbreeScene>> theirs;
    std::vector<Method> methods = {{"binned", [&](int) { mine = {}; }, timing([&] {
                                        mine = build_bvh(rig.topology(), rig.scene.positions,
                                                         {.threads = rig.arena.threads()});
                                    })}};
    for (const auto& [name, quality] : {std::pair("MEDIUM, binned", RTC_BUILD_QUALITY_MEDIUM),
                                        {"HIGH, spatial splits", RTC_BUILD_QUALITY_HIGH},
                                        {"LOW, Morton", RTC_BUILD_QUALITY_LOW}}) {
        for (const EmbreeDevice& device : rig.devices) {
            std::optional<EmbreeScene>& tree = theirs.emplace_back();
            const auto make_unbuilt = [&, quality = quality](int) {
                tree.emplace(device, rig.topology(), rig.scene.positions, quality);
            };
            methods.push_back({fmt::format("{}, {}", name, device.isa), make_unbuilt,
                               timing([&tree] { tree->commit(); }), name,
                               [&] { return rig.compare_trees(mine, *tree); }});
        }
    }
    rig.compare({"build", kMs}, methods);
}

/// Plays every second frame, 12 at most, and traces and shades an image with shadows: by the policy
/// Auto, by Embree's 16-wide packets, refitted or built again, and by the 2007 method, refitted.
void bench_frame(const Rig& rig) {
    const Played played(rig.scene);
    if (played.poses.size() < 2) return;
    std::deque<Frame> frames;
    std::vector<Method> methods;
    const auto add = [&](const PlayFrame& play_frame, std::string name, std::string group) {
        Frame& frame = frames.emplace_back(Frame{
            .width = played.params.width,
            .height = played.params.height,
            .hits = AlignedVector<Hit>(rig.pixels()),
            .occlusion = AlignedVector<std::uint32_t>(rig.pixels()),
            .pixels = AlignedVector<std::uint32_t>(rig.pixels()),
        });
        methods.push_back(
            {std::move(name),
             {},
             [play_frame, &frame](std::size_t number) { return play_frame(number, frame); },
             std::move(group),
             [&frame, &frames] { return count_other_triangles(frame.hits, frames[0].hits); }});
    };
    add(our_frames(played, rig.arena), "auto", "");
    for (const auto& [quality, name] : {std::pair(RTC_BUILD_QUALITY_REFIT, "REFIT"),
                                        {RTC_BUILD_QUALITY_LOW, "LOW"},
                                        {RTC_BUILD_QUALITY_MEDIUM, "MEDIUM"}}) {
        for (const EmbreeDevice& device : rig.devices) {
            add(embree_frames(played, device, quality, rig.arena),
                fmt::format("{}, Intersect16, {}", name, device.isa), name);
        }
    }
    add(paper_frames(played, rig.arena), "paper-2007, refit", "paper-2007");
    rig.compare({"frame", kMs}, methods, played.poses.size());
}

/// Queries by the public interface the closest points, against Embree's point queries, and counts
/// of hits and insides, against Embree's single rays with a filter.
void bench_queries(const Rig& rig) {
    const morphray::Scene ours = user_scene(rig, rig.scene.positions);
    std::deque<EmbreeQueries> peers;
    for (const bool robust : {true, false})
        for (const EmbreeDevice& device : rig.devices)
            peers.emplace_back(device, rig.topology(), rig.scene.positions, robust, rig.pixels());
    // differs(peer, i) says whether our answer i is not that of the peer's last call.
    const auto compare = [&](const char* work, const char* where, const auto& run, const char* way,
                             const auto& run_peer, const auto& differs) {
        std::vector<Method> methods = {{where, {}, timing(run)}};
        for (EmbreeQueries& peer : peers) {
            const auto differences = [&] {
                std::uint64_t count = 0;
                for (std::size_t i = 0; i < rig.pixels(); ++i) count += differs(peer, i);
                return count;
            };
            methods.push_back({way + peer.scene.name(),
                               {},
                               timing(rig.arena, [&] { run_peer(peer); }),
                               peer.scene.robust ? "robust" : "fast",
                               differences});
        }
        rig.compare({work, kNs, rig.pixels()}, methods);
    };
    const std::pair<const char*, std::vector<vec3>> places[] = {
        {"near", points_near_surface(rig.scene, rig.pixels())},
        {"in box", points_in_box(rig.scene, rig.pixels())}};
    for (const auto& [where, points] : places) {
        std::vector<morphray::ClosestPoint> found(points.size());
        compare(
            "closest", where,
            [&, &points = points] { ours.closest_points(to_user(points), found); }, "PointQuery ",
            [&, &points = points](EmbreeQueries& peer) { peer.find_closest(points); },
            [&](const EmbreeQueries& peer, std::size_t i) {
                const double a = found[i].distance;
                const double b = peer.nearest[i].distance;
                return a != b && std::abs(a - b) / (2 * kExtent) > kMostDifference;
            });
    }
    for (const bool is_image : {true, false}) {
        const std::vector<Ray> rays =
            is_image ? camera_rays(rig.scene.params) : random_rays(rig.scene, rig.pixels());
        std::vector<morphray::Ray> queried;
        for (const auto& [org, tnear, dir, tfar] : rays)
            queried.push_back({.org = {org.x, org.y, org.z}, .dir = {dir.x, dir.y, dir.z}});
        std::vector<std::uint64_t> counts(rays.size());
        const morphray::QueryOptions known{is_image
                                               ? morphray::Coherence::image(rig.scene.params.width)
                                               : morphray::Coherence::sort()};
        compare(
            "count", is_image ? "camera" : "random",
            [&] { ours.count(queried, counts, morphray::Crossing::each, known); }, "filter, ",
            [&](EmbreeQueries& peer) { peer.count(rays, is_image); },
            [&](const EmbreeQueries& peer, std::size_t i) { return counts[i] != peer.counts[i]; });
    }
    for (const auto& [where, points] : places) {
        std::vector<std::uint8_t> inside(points.size());
        std::vector<Ray> rays;
        for (const vec3& p : points) rays.push_back({p, 0, {0, 0, 1}, kInfiniteT});
        // By the rule that Embree's hits of a half-line can follow, too.
        compare(
            "contains", where,
            [&, &points = points] {
                ours.contains(to_user(points), inside, morphray::FillRule::odd);
            },
            "filter, ", [&](EmbreeQueries& peer) { peer.count(rays, false); },
            [&](const EmbreeQueries& peer, std::size_t i) {
                return inside[i] != peer.counts[i] % 2;
            });
    }
}

#ifdef MORPHRAY_CROSSING_PEERS
/// The frames of the scene in turn: the trees follow the positions, and all pairs are found.
void bench_crossings(const Rig& rig) {
    std::vector<vec3> positions = rig.scene.positions;
    std::size_t found = 0;
    const auto move = [&](int round) {
        positions = round % 2 == 0 ? rig.scene.moved : rig.scene.positions;
    };
    morphray::Scene ours = user_scene(rig, positions);
    std::vector<Method> methods = {{"refit, all pairs", move, timing([&] {
                                        ours.update();
                                        found = ours.crossings().pairs.size();
                                    })}};
    std::deque<std::size_t> counts;
    for (const CrossingPeer& peer : crossing_peers(rig.topology(), positions)) {
        std::size_t& count = counts.emplace_back();
        methods.push_back({peer.name + ", one thread", move,
                           timing([&, peer] { count = peer.count(positions); }), peer.name});
        if (peer.is_exact)
            methods.back().differences = [&] {
                return found > count ? found - count : count - found;
            };
    }
    rig.compare({"crossings", kMs}, methods);
}
#endif

void run_works(const Rig& rig, std::span<const RaySet> traced, const BenchOptions& options) {
    if (!traced.empty()) {
        const std::vector<EmbreeScene> embree =
            embree_variants(rig.devices, rig.topology(), rig.scene.positions);
        for (const RaySet& set : traced) bench_trace(rig, embree, set);
    }
    constexpr std::pair<const char*, void (*)(const Rig&)> kWorks[] = {
        {"queries", bench_queries},
#ifdef MORPHRAY_CROSSING_PEERS
        {"crossings", bench_crossings},
#endif
        {"frame", bench_frame},
        {"refit", bench_refit},
        {"build", bench_build}};
    for (const auto& [name, bench] : kWorks)
        if (options.wants(name)) bench(rig);
}

}  // namespace

int bench_beside_embree(const BenchOptions& options) {
    Report report(
        fmt::format("# {}, {}; morphray {}, Embree {}{}\n# ./lab/bench/run {}\n", machine_name(),
                    best_simd_target().name, kVersionDetail, RTC_VERSION_STRING,
                    kEmbreeHasStreams ? "" : ", which has no streams", options.line),
        options.csv);
    for (const std::string& spec : options.scenes) {
        const BenchScene scene = open_bench_scene(spec, options.size);
        // All rays are made before anything is timed.
        std::vector<RaySet> traced;
        for (const RayKind kind : kAllKinds)
            if (options.wants(name_of(kind))) traced.push_back(scene.rays(kind));
        for (const int threads : options.threads) {
            const std::vector<EmbreeDevice> devices = embree_devices(threads);
            report.begin(spec, threads);
            ThreadArena arena(threads);
            run_works({scene, devices, arena, options.repeat, report}, traced, options);
        }
    }
    return 0;
}

}  // namespace mray::lab
