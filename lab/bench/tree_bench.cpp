#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <deque>
#include <optional>

#include "common/bvh/builder/bvh_builder.h"
#include "cpu/refit/refit.h"
#include "lab/bench/works.h"

namespace mray::bench {
namespace {

std::uint64_t compare_trees(ThreadArena& arena, const TraceWork& work, const Bvh& ours,
                            const EmbreeScene& theirs) {
    return arena.execute([&] {
        return count_mismatches(work, reference_hits(ours, work), embree_hits(theirs, work));
    });
}

/// Copies as many bytes as a tree's nodes and leaves have, which is what a refit has to write.
class TreeCopy {
public:
    explicit TreeCopy(const Bvh& bvh)
        : from_(bvh.nodes.size() * sizeof(Node) + bvh.leaves.size() * sizeof(Leaf)),
          to_(from_.size()) {}

    void run() {
        constexpr std::size_t kChunk = 64 * 1024;
        const std::size_t chunks = (from_.size() + kChunk - 1) / kChunk;
        tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t i) {
            const std::size_t begin = i * kChunk;
            std::memcpy(to_.data() + begin, from_.data() + begin,
                        std::min(kChunk, from_.size() - begin));
        });
    }

private:
    std::vector<std::byte> from_;
    std::vector<std::byte> to_;
};

Topology first_triangles(const Topology& all, std::size_t count) {
    Topology some = all;
    some.triangles.resize(std::min(count, all.triangles.size()));
    return some;
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

/// The two frames in turn: after one run to warm up, the last of `repeat` has the moved one.
class Alternation {
public:
    Alternation(const BenchScene& scene, int repeat) : scene_(scene), left_(repeat) {}

    std::span<const vec3> next() { return left_-- % 2 == 0 ? scene_.moved : scene_.positions; }

private:
    const BenchScene& scene_;
    int left_;
};

/// A refit of Embree on one of its devices, with positions of its own.
class EmbreeMovingTree {
public:
    EmbreeMovingTree(const EmbreeDevice& device, const BenchScene& scene, int repeat)
        : frames_(scene, repeat),
          mesh_(scene.topology(), scene.positions),
          tree_(device, mesh_, RTC_BUILD_QUALITY_REFIT),
          small_topology_(first_triangles(scene.topology(), 20000)),
          small_mesh_(small_topology_, scene.positions),
          small_tree_(device, small_mesh_, RTC_BUILD_QUALITY_REFIT) {}

    const EmbreeScene& tree() const { return tree_; }

    void prepare() {
        mesh_.set_positions(frames_.next());
        // Small refits keep Embree's threads awake.
        for (int i = 0; i < 2; ++i) small_tree_.update();
    }
    void run() { tree_.update(); }

private:
    Alternation frames_;
    EmbreeMesh mesh_;
    EmbreeScene tree_;
    Topology small_topology_;
    EmbreeMesh small_mesh_;
    EmbreeScene small_tree_;
};

}  // namespace

void bench_refit(const Rig& rig, const BenchScene& scene, const TraceWork& primary) {
    ThreadArena arena(rig.threads);
    Bvh bvh = scene.bvh;
    std::vector<vec3> positions = scene.positions;
    Alternation frames(scene, rig.repeat);
    std::deque<EmbreeMovingTree> theirs;
    TreeCopy copy(scene.bvh);

    // Positions are copied and threads woken outside the timing, as moving vertices would do.
    std::vector<Method> methods;
    methods.push_back(
        {"levels",
         [&] {
             const std::span<const vec3> now = frames.next();
             std::copy(now.begin(), now.end(), positions.begin());
             wake_up(arena);
         },
         [&](std::size_t) { return timed_in(arena, [&] { cpu::refit(bvh, positions); }); }});
    for (const EmbreeDevice& device : rig.devices) {
        EmbreeMovingTree& tree = theirs.emplace_back(device, scene, rig.repeat);
        methods.push_back({fmt::format("REFIT, {}", device.isa()), [&] { tree.prepare(); },
                           [&](std::size_t) { return timed([&] { tree.run(); }); }, "Embree",
                           [&] { return compare_trees(arena, primary, bvh, tree.tree()); }});
    }
    methods.push_back({"memcpy", [&] { wake_up(arena); },
                       [&](std::size_t) { return timed_in(arena, [&] { copy.run(); }); },
                       "memcpy"});
    rig.report.compare({"refit", Unit::kNs, scene.topology().triangles.size()}, methods, 1,
                       rig.repeat);
}

void bench_build(const Rig& rig, const BenchScene& scene, const TraceWork& primary) {
    ThreadArena arena(rig.threads);
    Bvh mine;
    const EmbreeMesh mesh(scene.topology(), scene.positions);
    const struct {
        const char* name;
        RTCBuildQuality quality;
    } kinds[] = {{"MEDIUM, binned", RTC_BUILD_QUALITY_MEDIUM},
                 {"HIGH, spatial splits", RTC_BUILD_QUALITY_HIGH},
                 {"LOW, Morton", RTC_BUILD_QUALITY_LOW}};
    std::deque<std::optional<EmbreeScene>> theirs;

    std::vector<Method> methods = {{"binned", [&] { mine = {}; },
                                    [&](std::size_t) {
                                        return timed([&] {
                                            mine = build_bvh(scene.topology(), scene.positions,
                                                             {.threads = rig.threads});
                                        });
                                    }}};
    for (const auto& kind : kinds) {
        for (const EmbreeDevice& device : rig.devices) {
            std::optional<EmbreeScene>& tree = theirs.emplace_back();
            methods.push_back(
                {fmt::format("{}, {}", kind.name, device.isa()), [&] { tree.reset(); },
                 [&](std::size_t) {
                     return timed([&] { tree.emplace(device, mesh, kind.quality); });
                 },
                 kind.name, [&] { return compare_trees(arena, primary, mine, *tree); }});
        }
    }
    rig.report.compare({"build", Unit::kMs}, methods, 1, rig.repeat);
}

}  // namespace mray::bench
