// Measures morphray side by side with Embree: each work compares all methods of morphray with every
// peer.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
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
#include "common/simd/simd_target.h"
#include "common/update/tree_updater.h"
#include "common/version.h"
#include "cpu/cpu_backend.h"
#include "cpu/refit/refit.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/options.h"
#include "lab/methods/embree.h"
#include "lab/methods/paper_2007.h"
#include "lab/methods/report.h"
#include "morphray/morphray.hpp"

namespace mray::lab {
namespace {

/// The same number of threads for both sides.
struct Rig {
    /// One for each instruction set of Embree.
    std::span<const EmbreeDevice> devices;
    ThreadArena& arena;
    int repeat;
    Report& report;
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

std::uint64_t compare_trees(ThreadArena& arena, const RaySet& set, const Bvh& ours,
                            const EmbreeScene& theirs) {
    return arena.execute([&] {
        return count_mismatches(set, trace_all(reference_tracer(ours, set), set),
                                trace_all(embree_tracer(theirs, set), set));
    });
}

/// Returns when all threads of the arena run in it, or after 2 ms.
void wake_up(ThreadArena& arena) {
    using Clock = std::chrono::steady_clock;
    const auto end = Clock::now() + std::chrono::milliseconds(2);
    std::atomic<int> awake = 0;
    arena.execute([&] {
        tbb::parallel_for(
            0, arena.threads(),
            [&](int) {
                ++awake;
                while (awake < arena.threads() && Clock::now() < end) {
                }
            },
            tbb::simple_partitioner());
    });
}

/// Returns the two frames in turn: after one run to warm up, the last of `repeat` has the moved
/// one.
auto alternation(const BenchScene& scene, int repeat) {
    return [&scene, left = repeat]() mutable {
        return std::span<const vec3>(left-- % 2 == 0 ? scene.moved : scene.positions);
    };
}

// Frames of an animation that are played: every second one, from the first one on.
constexpr std::size_t kMostFrames = 12;
constexpr double kFrameStep = 2;

struct Played {
    const BenchScene& scene;
    ImageParams params;
    std::vector<std::vector<vec3>> poses;

    const Topology& topology() const { return scene.topology(); }
    cpu::ShadedMesh mesh(std::size_t frame) const { return {&scene.topology(), poses[frame]}; }
};

Played play(const BenchScene& scene) {
    Played played{scene, scene.params, {}};
    played.params.rays = kRaysShadow;
    const Animation& animation = *scene.animation;
    for (double frame = animation.first_frame();
         frame <= animation.last_frame() && played.poses.size() < kMostFrames; frame += kFrameStep)
        played.poses.push_back(positions_at(scene, frame));
    return played;
}

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
        const Stopwatch stopwatch;
        arena.execute([&] { pose->move_to(played.poses[number]); });
        updater->update();
        backend->trace_image(played.params, frame);
        updater->frame_done({.ms = backend->finish().trace_ms, .rays = backend->finish().rays});
        return stopwatch.ms();
    };
}

/// Its positions are written to the mesh before the time begins. Shades by our code.
PlayFrame embree_frames(const Played& played, const EmbreeDevice& device, RTCBuildQuality quality,
                        ThreadArena& arena) {
    const auto scene =
        std::make_shared<EmbreeScene>(device, played.topology(), played.poses.front(), quality);
    scene->commit();
    return [&played, &arena, scene, shader = cpu::PixelShader(best_simd_target())](
               std::size_t number, Frame& frame) {
        scene->set_positions(played.poses[number]);
        return timed([&] {
            scene->commit();
            arena.execute(
                [&] { trace_frame(*scene, played.params, played.mesh(number), shader, frame); });
        });
    };
}

/// Does the work that others do between rays.
void shade(const cpu::PixelShader& shader, const ImageParams& params, const cpu::ShadedMesh& mesh,
           Frame& frame) {
    const cpu::ImageTiles squares(frame.width, frame.height, cpu::kSquareSide);
    tbb::parallel_for(std::uint32_t{0}, squares.count(), [&](std::uint32_t i) {
        cpu::SharedOriginRays rays[cpu::kSquareBlocks];
        cpu::LitPixels lit[cpu::kSquareBlocks];
        const std::uint8_t occluded[cpu::kSquareRays] = {};
        const cpu::ImageRegion part{params, mesh, squares[i], frame};
        shader.make_shadow_rays(part, rays, lit);
        shader.shade_shadows(part, occluded, lit);
    });
}

/// Its packets are made before the time begins. Our code makes shadow rays and shades.
PlayFrame paper_frames(const Played& played, const RaySet& primary, ThreadArena& arena) {
    const auto tree =
        std::make_shared<PeerTree>(build_paper_tree(played.topology(), played.poses.front()));
    return [&played, &primary, &arena, tree, camera = paper_tracer(*tree, primary),
            shader = cpu::PixelShader(best_simd_target())](std::size_t number, Frame& frame) {
        const double to_hits_ms = timed([&] {
            arena.execute([&] {
                refit(*tree, played.topology(), played.poses[number]);
                camera.trace(primary.whole());
            });
        });
        const AlignedVector<Hit> hits = camera.answers().hits;
        for (const TileRays& tile : primary.tiles) {
            std::size_t ray = tile.begin;
            for_each_pixel(tile.tile, [&](std::uint32_t x, std::uint32_t y) {
                frame.hits[std::size_t{y} * frame.width + x] = hits[ray++];
            });
        }
        const cpu::ShadedMesh mesh = played.mesh(number);
        const RaySet shadow = make_secondary_rays(primary, hits, mesh, RayKind::kShadow);
        const Tracer light = paper_tracer(*tree, shadow);
        return to_hits_ms + timed([&] {
                   arena.execute([&] {
                       light.trace(shadow.whole());
                       shade(shader, played.params, mesh, frame);
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

std::vector<morphray::Ray> to_user(const std::vector<Ray>& rays) {
    std::vector<morphray::Ray> result;
    for (const Ray& ray : rays) {
        result.push_back(
            {.org = {ray.org.x, ray.org.y, ray.org.z}, .dir = {ray.dir.x, ray.dir.y, ray.dir.z}});
    }
    return result;
}

/// The scene behind the public interface.
morphray::Scene user_scene(const Rig& rig, const BenchScene& scene) {
    return morphray::Scene::build({.positions = morphray::packed(to_user(scene.positions)),
                                   .triangles = {&scene.topology().triangles.data()->x,
                                                 3 * scene.topology().triangles.size()}},
                                  morphray::Device::cpu({.threads = rig.arena.threads()}),
                                  {.bounds = kBounds, .update = morphray::Refit{}});
}

/// The view of an image's parameters.
morphray::View pinhole_view(const ImageParams& params) {
    const Camera& camera = params.camera;
    const double fx = 1 / glm::length(dvec3(camera.du));
    const double fy = 1 / glm::length(dvec3(camera.dv));
    const dvec3 right = fx * dvec3(camera.du);
    const dvec3 down = fy * dvec3(camera.dv);
    const dvec3 columns[] = {right, down, glm::cross(right, down), dvec3(camera.org)};
    morphray::Pinhole pinhole{{},
                              fx,
                              fy,
                              -fx * glm::dot(dvec3(camera.corner), right),
                              -fy * glm::dot(dvec3(camera.corner), down)};
    for (int row = 0; row < 3; ++row)
        for (int k = 0; k < 4; ++k) pinhole.to_world[row][k] = columns[k][row];
    return {.pinhole = pinhole, .width = params.width, .height = params.height};
}

/// The same scene behind the public interface and as the peers have it.
class Queries {
public:
    Queries(const Rig& rig, const BenchScene& scene) : rig_(rig), ours_(user_scene(rig, scene)) {
        const std::size_t count = std::size_t{scene.params.width} * scene.params.height;
        for (const bool robust : {true, false}) {
            for (const EmbreeDevice& device : rig.devices)
                embree_.emplace_back(device, scene.topology(), scene.positions, robust, count);
        }
    }

    void find_closest(const char* where, const std::vector<vec3>& points) {
        std::vector<morphray::ClosestPoint> ours(points.size());
        std::vector<NearestPoint> theirs(points.size());
        const auto differs = [](double a, double b) {
            return a != b && std::abs(a - b) / (2 * kExtent) > kMostDifference;
        };
        std::vector<Method> methods = {
            {where, {}, timing([&] { ours_.closest_points(to_user(points), ours); })}};
        for (const EmbreeQueries& embree : embree_) {
            const auto run = timing(rig_.arena, [&] { embree.find_closest(points, theirs); });
            const auto differences = [&, run] {
                run(0);
                std::uint64_t count = 0;
                for (std::size_t i = 0; i < points.size(); ++i)
                    count += differs(ours[i].distance, theirs[i].distance);
                return count;
            };
            methods.push_back(
                {"PointQuery " + embree.name(), {}, run, embree.group(), differences});
        }
        rig_.report.compare({"closest", Unit::kNs, points.size()}, methods, 1, rig_.repeat);
    }

    /// Of an image of rays that are `width` a row, or of rays in any order for 0.
    void count(const char* which, const std::vector<Ray>& rays, std::uint32_t width) {
        const std::vector<morphray::Ray> queried = to_user(rays);
        std::vector<std::uint64_t> ours(rays.size());
        const morphray::QueryOptions known{width > 0 ? morphray::Coherence::image(width)
                                                     : morphray::Coherence::sort()};
        compare_counts(
            "count", which, rays, width > 0,
            [&] { ours_.count(queried, ours, morphray::Crossing::each, known); },
            [&](std::size_t i, std::uint64_t hits) { return ours[i] != hits; });
    }

    /// By the rule that Embree's hits of a half-line can follow, too.
    void find_inside(const char* where, const std::vector<vec3>& points) {
        std::vector<std::uint8_t> ours(points.size());
        compare_counts(
            "contains", where, rays_up(points), false,
            [&] { ours_.contains(to_user(points), ours, morphray::FillRule::odd); },
            [&](std::size_t i, std::uint64_t hits) { return ours[i] != hits % 2; });
    }

private:
    /// differs(i, hits) says whether our answer i is not that of so many hits of a ray.
    template <class Run, class Differs>
    void compare_counts(const char* work, const char* where, const std::vector<Ray>& rays,
                        bool coherent, const Run& run, const Differs& differs) {
        std::vector<Method> methods = {{where, {}, timing(run)}};
        for (EmbreeQueries& embree : embree_) {
            const auto differences = [&] {
                std::uint64_t count = 0;
                for (std::size_t i = 0; i < rays.size(); ++i)
                    count += differs(i, embree.counts()[i]);
                return count;
            };
            methods.push_back({"filter, " + embree.name(),
                               {},
                               timing(rig_.arena, [&] { embree.count(rays, coherent); }),
                               embree.group(),
                               differences});
        }
        rig_.report.compare({work, Unit::kNs, rays.size()}, methods, 1, rig_.repeat);
    }

    const Rig& rig_;
    std::deque<EmbreeQueries> embree_;
    morphray::Scene ours_;
};

/// By every suitable tracer, against each group of Embree's ways: the fastest of a trial.
void bench_trace(const Rig& rig, const BenchScene& scene, std::span<const EmbreeVariant> embree,
                 const RaySet& set) {
    const std::vector<TileRange> parts = set.ranges(
        set.tiles.size() / (kTilesOfPart * static_cast<std::size_t>(rig.arena.threads())));
    PeerTree paper_tree;
    std::vector<Tracer> tracers = finalists_of(embree_peers(embree, set), rig.arena, parts);
    if (set.kind == RayKind::kPrimary || set.kind == RayKind::kShadow) {
        paper_tree = build_paper_tree(scene.topology(), scene.positions);
        tracers.push_back(paper_tracer(paper_tree, set));
    }
    const std::size_t peers = tracers.size();
    for (Tracer& ours : our_tracers(scene.bvh, best_simd_target(), set))
        tracers.push_back(std::move(ours));
    const std::vector<Method> methods = methods_of(tracers, rig.arena, parts);
    const std::vector<Times> times = time_in_turn(methods, parts.size(), rig.repeat);

    for (const std::size_t best :
         fastest_of_groups(std::span(methods).first(peers), std::span(times).first(peers), 1)) {
        const Tracer& peer = tracers[best];
        const TraceAnswers answers = rig.arena.execute([&] { return trace_all(peer, set); });
        for (std::size_t i = peers; i < tracers.size(); ++i) {
            if (!comparable(tracers[i], peer)) continue;
            rig.report.add({name_of(set.kind), Unit::kMrayPerSecond, set.active_count,
                            tracers[i].name, peer.name, times[i], times[best],
                            count_mismatches(set, tracers[i].answers(), answers)});
        }
    }
}

/// Against Embree's refit and a copy of the tree's bytes. `primary` is traced through both trees.
void bench_refit(const Rig& rig, const BenchScene& scene, const RaySet& primary) {
    Bvh bvh = scene.bvh;
    std::vector<vec3> positions = scene.positions;
    auto our_next = alternation(scene, rig.repeat);
    struct EmbreeRefit {
        decltype(our_next) next;
        EmbreeScene tree;
        EmbreeScene small_tree;
    };
    std::deque<EmbreeRefit> theirs;
    Topology few = scene.topology();
    few.triangles.resize(std::min<std::size_t>(20000, few.triangles.size()));
    // A refit has to write as many bytes as the tree's nodes and leaves have.
    const std::vector<std::byte> from(bvh.nodes.size() * sizeof(Node) +
                                      bvh.leaves.size() * sizeof(Leaf));
    std::vector<std::byte> to(from.size());
    const auto copy = [&] {
        constexpr std::size_t kChunk = 64 * 1024;
        tbb::parallel_for(std::size_t{0}, (from.size() + kChunk - 1) / kChunk, [&](std::size_t i) {
            const std::size_t begin = i * kChunk;
            std::memcpy(&to[begin], &from[begin], std::min(kChunk, from.size() - begin));
        });
    };

    // Positions are copied and threads woken outside the timing, as moving vertices would do.
    std::vector<Method> methods;
    methods.push_back({"levels",
                       [&] {
                           const std::span<const vec3> now = our_next();
                           std::copy(now.begin(), now.end(), positions.begin());
                           wake_up(rig.arena);
                       },
                       timing(rig.arena, [&] { cpu::refit(bvh, positions); })});
    for (const EmbreeDevice& device : rig.devices) {
        theirs.push_back(
            {alternation(scene, rig.repeat),
             EmbreeScene(device, scene.topology(), scene.positions, RTC_BUILD_QUALITY_REFIT),
             EmbreeScene(device, few, scene.positions, RTC_BUILD_QUALITY_REFIT)});
        EmbreeRefit& one = theirs.back();
        one.tree.commit();
        methods.push_back({fmt::format("REFIT, {}", device.isa),
                           [&one] {
                               one.tree.set_positions(one.next());
                               // Small refits keep Embree's threads awake.
                               for (int i = 0; i < 2; ++i) one.small_tree.commit();
                           },
                           timing([&one] { one.tree.commit(); }), "Embree",
                           [&] { return compare_trees(rig.arena, primary, bvh, one.tree); }});
    }
    methods.push_back({"memcpy", [&] { wake_up(rig.arena); }, timing(rig.arena, copy), "memcpy"});
    rig.report.compare({"refit", Unit::kNs, scene.topology().triangles.size()}, methods, 1,
                       rig.repeat);
}

/// Builds trees, against Embree's Morton, binned and spatial-split builds; `primary` as above.
void bench_build(const Rig& rig, const BenchScene& scene, const RaySet& primary) {
    Bvh mine;
    std::deque<std::optional<EmbreeScene>> theirs;
    std::vector<Method> methods = {{"binned", [&] { mine = {}; }, timing([&] {
                                        mine = build_bvh(scene.topology(), scene.positions,
                                                         {.threads = rig.arena.threads()});
                                    })}};
    for (const auto& [name, quality] : {std::pair("MEDIUM, binned", RTC_BUILD_QUALITY_MEDIUM),
                                        {"HIGH, spatial splits", RTC_BUILD_QUALITY_HIGH},
                                        {"LOW, Morton", RTC_BUILD_QUALITY_LOW}}) {
        for (const EmbreeDevice& device : rig.devices) {
            std::optional<EmbreeScene>& tree = theirs.emplace_back();
            const RTCBuildQuality this_quality = quality;
            const auto make_unbuilt = [&scene, &device, &tree, this_quality] {
                tree.emplace(device, scene.topology(), scene.positions, this_quality);
            };
            methods.push_back({fmt::format("{}, {}", name, device.isa), make_unbuilt,
                               timing([&tree] { tree->commit(); }), name,
                               [&] { return compare_trees(rig.arena, primary, mine, *tree); }});
        }
    }
    rig.report.compare({"build", Unit::kMs}, methods, 1, rig.repeat);
}

/// Plays every second frame, 12 at most, and traces and shades an image with shadows: by the policy
/// Auto, by Embree's 16-wide packets, refitted or built again, and by the 2007 method, refitted.
void bench_frame(const Rig& rig, const BenchScene& scene, const RaySet& primary) {
    const Played played = play(scene);
    if (played.poses.size() < 2) return;
    const std::size_t pixels = std::size_t{scene.params.width} * scene.params.height;
    std::deque<Frame> frames;
    std::vector<Method> methods;
    const auto add = [&](const PlayFrame& play_frame, std::string name, std::string group) {
        Frame& frame = frames.emplace_back(Frame{
            .width = played.params.width,
            .height = played.params.height,
            .hits = AlignedVector<Hit>(pixels),
            .occlusion = AlignedVector<std::uint32_t>(pixels),
            .pixels = AlignedVector<std::uint32_t>(pixels),
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
    add(paper_frames(played, primary, rig.arena), "paper-2007, refit", "paper-2007");
    rig.report.compare({"frame", Unit::kMs}, methods, played.poses.size(), rig.repeat);
}

/// Renders the image as 256 views in one call of the public interface, against the same call with
/// the whole image for one view, and against an image with hits and colours.
void bench_views(const Rig& rig, const BenchScene& scene) {
    constexpr std::uint32_t kSide = 16;
    const morphray::Scene ours = user_scene(rig, scene);
    const morphray::View whole = pinhole_view(scene.params);
    std::vector<morphray::View> views(kSide * kSide, whole);
    for (std::uint32_t i = 0; i < views.size(); ++i) {
        morphray::View& view = views[i];
        view.width /= kSide;
        view.height /= kSide;
        view.pinhole->cx -= i % kSide * view.width;
        view.pinhole->cy -= i / kSide * view.height;
    }
    const std::size_t pixels = std::size_t{whole.width} * whole.height;
    std::vector<float> depths(pixels);
    std::vector<std::uint32_t> prim_ids(pixels);
    morphray::ImageStack stack{.depth = depths, .prim_id = prim_ids};
    morphray::Image image;
    const std::vector<Method> methods = {
        {"256 views", {}, timing([&] { ours.render(views, stack); })},
        {"one view",
         {},
         timing([&] {
             ours.render({&whole, 1}, stack);
         }),
         "view"},
        {"image", {}, timing([&] { ours.render(whole, image); }), "image"}};
    rig.report.compare({"views", Unit::kMrayPerSecond, pixels}, methods, 1, rig.repeat);
}

/// Queries by the public interface the closest points, against Embree's point queries, and counts
/// of hits and insides, against Embree's single rays with a filter.
void bench_queries(const Rig& rig, const BenchScene& scene) {
    Queries queries(rig, scene);
    const std::uint32_t width = scene.params.width;
    const std::size_t count = std::size_t{width} * scene.params.height;
    const std::vector<vec3> near = points_near_surface(scene, count);
    const std::vector<vec3> in_box = points_in_box(scene, count);
    queries.find_closest("near", near);
    queries.find_closest("in box", in_box);
    queries.count("camera", camera_rays(scene.params), width);
    queries.count("random", random_rays(scene, count), 0);
    queries.find_inside("near", near);
    queries.find_inside("in box", in_box);
}

void run_works(const Rig& rig, const BenchScene& scene, const SceneRays& rays,
               std::span<const RaySet> traced, const BenchOptions& options) {
    if (!traced.empty()) {
        const std::vector<EmbreeVariant> embree =
            embree_variants(rig.devices, scene.topology(), scene.positions);
        for (const RaySet& set : traced) bench_trace(rig, scene, embree, set);
    }
    if (options.wants("queries")) bench_queries(rig, scene);
    if (options.wants("views")) bench_views(rig, scene);
    if (options.wants("frame")) bench_frame(rig, scene, rays.primary());
    if (options.wants("refit")) bench_refit(rig, scene, rays.primary());
    if (options.wants("build")) bench_build(rig, scene, rays.primary());
}

int run(const BenchOptions& options) {
    Report report(
        fmt::format("# {}, {}; morphray {}, Embree {}{}\n# ./lab/bench/run {}\n", machine_name(),
                    best_simd_target().name, kVersionDetail, RTC_VERSION_STRING,
                    kEmbreeHasStreams ? "" : ", which has no streams", options.line),
        options.csv);
    for (const std::string& spec : options.scenes) {
        const BenchScene scene = open_bench_scene(spec, options.view);
        // All rays are made before anything is timed.
        const SceneRays rays(scene);
        std::vector<RaySet> traced;
        for (const RayKind kind : kAllKinds)
            if (options.wants(name_of(kind))) traced.push_back(rays.rays(kind));
        for (const int threads : options.threads) {
            const std::vector<EmbreeDevice> devices = embree_devices(threads);
            report.begin(spec, threads);
            ThreadArena arena(threads);
            run_works({devices, arena, options.repeat, report}, scene, rays, traced, options);
        }
    }
    return 0;
}

}  // namespace
}  // namespace mray::lab

int main(int argc, char** argv) {
    using namespace mray::lab;
    return bench_main(BenchProgram::kRun, argc, argv, run);
}
