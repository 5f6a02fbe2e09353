#include <atomic>
#include <chrono>
#include <cstring>
#include <optional>

#include "bench/embree/embree_tracer.h"
#include "bench/works/ours.h"
#include "bench/works/works.h"
#include "common/base/thread_arena.h"

namespace mray::bench {
namespace {

std::vector<Hit> embree_hits(const EmbreeScene& scene, const TraceWork& work) {
    const std::unique_ptr<EmbreeTracer> tracer = embree_ways(work.params.rays)[0].make(work);
    tracer->reset();
    tracer->trace(scene);
    return tracer->answers().hits;
}

Mismatches compare_trees(ThreadArena& arena, const TraceWork& work, const Bvh& ours,
                         const EmbreeScene& theirs) {
    return arena.execute(
        [&] { return compare_hits(work, reference_hits(ours, work), embree_hits(theirs, work)); });
}

/// Copies bytes of the size of a tree's nodes and leaves, which is what a refit has to write.
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

/// Small refits by Embree, which keep its threads awake.
class EmbreeWaker {
public:
    EmbreeWaker(const EmbreeDevice& device, const BenchScene& scene)
        : topology_(first_triangles(scene.topology())),
          mesh_(topology_, scene.positions),
          tree_(device, mesh_, EmbreeTree::kRefitted) {}

    void run() {
        for (int i = 0; i < 2; ++i) tree_.update();
    }

private:
    static Topology first_triangles(const Topology& all) {
        constexpr std::size_t kTriangles = 20000;
        Topology some = all;
        some.triangles.resize(std::min(kTriangles, all.triangles.size()));
        return some;
    }

    Topology topology_;
    EmbreeMesh mesh_;
    EmbreeScene tree_;
};

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

/// A refit of morphray with its own tree and positions.
struct OurMovingTree {
    const OurRefit* refit;
    Bvh bvh;
    std::vector<vec3> positions;
};

}  // namespace

void bench_refit(const Rig& rig, const BenchScene& scene, const TraceWork& primary) {
    ThreadArena arena(rig.threads);
    const std::vector<OurRefit> refits = our_refits();
    std::vector<OurMovingTree> mine;
    mine.reserve(refits.size());
    for (const OurRefit& refit : refits) mine.push_back({&refit, scene.bvh, scene.positions});
    EmbreeMesh mesh(scene.topology(), scene.positions);
    EmbreeScene refitted(rig.device, mesh, EmbreeTree::kRefitted);
    EmbreeWaker waker(rig.device, scene);
    TreeCopy copy(scene.bvh);

    // The positions of each side alternate between the frames and are copied outside the timing.
    // Every method is prepared once a round, and the last round has the moved frame. The threads
    // are woken up, as moving the vertices would do: threads that wait in another arena would take
    // longer to wake up than a small refit lasts.
    std::size_t round = static_cast<std::size_t>(rig.repeat) % 2;
    const auto frame = [&] { return std::span(round % 2 == 0 ? scene.moved : scene.positions); };
    std::vector<Method> methods;
    methods.reserve(mine.size() + 2);
    for (OurMovingTree& tree : mine) {
        methods.push_back(
            {tree.refit->name,
             [&] {
                 const std::span<const vec3> now = frame();
                 std::copy(now.begin(), now.end(), tree.positions.begin());
                 wake_up(arena);
             },
             [&] { arena.execute([&] { tree.refit->refit(tree.bvh, tree.positions); }); }});
    }
    methods.push_back({"Embree REFIT",
                       [&] {
                           mesh.set_positions(frame());
                           waker.run();
                       },
                       [&] { refitted.update(); }});
    methods.push_back({"memcpy",
                       [&] {
                           ++round;
                           wake_up(arena);
                       },
                       [&] { arena.execute([&] { copy.run(); }); }});
    const std::vector<Samples> samples = time_interleaved(methods, rig.repeat);

    for (std::size_t i = 0; i < mine.size(); ++i) {
        const Mismatches mismatches = compare_trees(arena, primary, mine[i].bvh, refitted);
        for (std::size_t peer = mine.size(); peer < methods.size(); ++peer) {
            Row row = row_of(rig, scene, "refit");
            row.tracer = mine[i].refit->name;
            row.target = mine[i].refit->target;
            row.peer = methods[peer].name;
            if (peer == mine.size()) row.mismatches = mismatches;
            set_times(row, samples[i], samples[peer], Unit::kNsPerTriangle, row.triangles);
            rig.report(row);
        }
    }
}

void bench_build(const Rig& rig, const BenchScene& scene, const TraceWork& primary) {
    ThreadArena arena(rig.threads);
    const std::vector<OurBuild> builds = our_builds();
    std::vector<Bvh> mine(builds.size());
    const EmbreeMesh mesh(scene.topology(), scene.positions);
    const struct {
        const char* name;
        EmbreeTree tree;
    } kinds[] = {{"Embree MEDIUM", EmbreeTree::kMedium},
                 {"Embree HIGH", EmbreeTree::kHigh},
                 {"Embree LOW (Morton)", EmbreeTree::kLow}};
    std::optional<EmbreeScene> theirs[std::size(kinds)];

    std::vector<Method> methods;
    methods.reserve(builds.size() + std::size(kinds));
    for (std::size_t i = 0; i < builds.size(); ++i) {
        methods.push_back({builds[i].name, [&, i] { mine[i] = {}; },
                           [&, i] {
                               mine[i] =
                                   builds[i].build(scene.topology(), scene.positions, rig.threads);
                           }});
    }
    for (std::size_t i = 0; i < std::size(kinds); ++i) {
        methods.push_back({kinds[i].name, [&, i] { theirs[i].reset(); },
                           [&, i] { theirs[i].emplace(rig.device, mesh, kinds[i].tree); }});
    }
    const std::vector<Samples> samples = time_interleaved(methods, rig.repeat);

    for (std::size_t i = 0; i < builds.size(); ++i) {
        for (std::size_t k = 0; k < std::size(kinds); ++k) {
            Row row = row_of(rig, scene, "build");
            row.tracer = builds[i].name;
            row.target = builds[i].target;
            row.peer = kinds[k].name;
            row.mismatches = compare_trees(arena, primary, mine[i], *theirs[k]);
            set_times(row, samples[i], samples[builds.size() + k], Unit::kMs, row.triangles);
            rig.report(row);
        }
    }
}

}  // namespace mray::bench
