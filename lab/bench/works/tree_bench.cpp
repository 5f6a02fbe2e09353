#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <deque>
#include <optional>
#include <string>

#include "common/base/thread_arena.h"
#include "lab/bench/embree/embree_tracer.h"
#include "lab/bench/works/ours.h"
#include "lab/bench/works/works.h"

namespace mray::bench {
namespace {

AlignedVector<Hit> embree_hits(const EmbreeScene& scene, const TraceWork& work) {
    const std::unique_ptr<EmbreeTracer> tracer = embree_ways(work.kind).front().make(work);
    tracer->trace(scene, work.whole());
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

/// A refit of Embree on one of its devices, with positions of its own.
class EmbreeMovingTree {
public:
    EmbreeMovingTree(const EmbreeDevice& device, const BenchScene& scene)
        : name_(fmt::format("Embree REFIT ({})", device.isa())),
          mesh_(scene.topology(), scene.positions),
          tree_(device, mesh_, EmbreeTree::kRefitted),
          waker_(device, scene) {}

    const std::string& name() const { return name_; }
    const EmbreeScene& tree() const { return tree_; }

    void prepare(std::span<const vec3> positions) {
        mesh_.set_positions(positions);
        waker_.run();
    }
    void run() { tree_.update(); }

private:
    std::string name_;
    EmbreeMesh mesh_;
    EmbreeScene tree_;
    EmbreeWaker waker_;
};

/// The index of the samples with the smallest median.
std::size_t fastest(std::span<const Samples> samples) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < samples.size(); ++i) {
        if (median(samples[i]) < median(samples[best])) best = i;
    }
    return best;
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
    std::deque<EmbreeMovingTree> theirs;
    for (const EmbreeDevice& device : rig.devices) theirs.emplace_back(device, scene);
    TreeCopy copy(scene.bvh);

    // The positions of each side alternate between the frames and are copied outside the timing.
    // Every method is prepared once a round, and the last round has the moved frame. The threads
    // are woken up, as moving the vertices would do: threads that wait in another arena would take
    // longer to wake up than a small refit lasts.
    std::size_t round = static_cast<std::size_t>(rig.repeat) % 2;
    const auto frame = [&] { return std::span(round % 2 == 0 ? scene.moved : scene.positions); };
    std::vector<Method> methods;
    methods.reserve(mine.size() + theirs.size() + 1);
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
    for (EmbreeMovingTree& tree : theirs)
        methods.push_back({tree.name(), [&] { tree.prepare(frame()); }, [&] { tree.run(); }});
    methods.push_back({"memcpy",
                       [&] {
                           ++round;
                           wake_up(arena);
                       },
                       [&] { arena.execute([&] { copy.run(); }); }});
    const std::vector<Samples> samples = time_interleaved(methods, rig.repeat);

    const std::size_t best = fastest(std::span(samples).subspan(mine.size(), theirs.size()));
    const std::size_t peers[] = {mine.size() + best, methods.size() - 1};
    for (std::size_t i = 0; i < mine.size(); ++i) {
        const Mismatches mismatches =
            compare_trees(arena, primary, mine[i].bvh, theirs[best].tree());
        for (const std::size_t peer : peers) {
            Row row = row_of(rig, scene, "refit");
            row.tracer = mine[i].refit->name;
            row.target = mine[i].refit->target;
            row.peer = methods[peer].name;
            if (peer == peers[0]) row.mismatches = mismatches;
            set_times(row, times_of(samples[i]), times_of(samples[peer]), Unit::kNsPerTriangle,
                      row.triangles);
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
    } kinds[] = {{"Embree MEDIUM (binned", EmbreeTree::kMedium},
                 {"Embree HIGH (spatial splits", EmbreeTree::kHigh},
                 {"Embree LOW (Morton", EmbreeTree::kLow}};
    // By kind, then by device.
    std::vector<std::vector<std::optional<EmbreeScene>>> theirs(std::size(kinds));
    const std::size_t devices = rig.devices.size();

    std::vector<Method> methods;
    methods.reserve(builds.size() + std::size(kinds) * devices);
    for (std::size_t i = 0; i < builds.size(); ++i) {
        methods.push_back({builds[i].name, [&, i] { mine[i] = {}; },
                           [&, i] {
                               mine[i] =
                                   builds[i].build(scene.topology(), scene.positions, rig.threads);
                           }});
    }
    for (std::size_t i = 0; i < std::size(kinds); ++i) {
        theirs[i].resize(devices);
        for (std::size_t d = 0; d < devices; ++d) {
            std::optional<EmbreeScene>& tree = theirs[i][d];
            const EmbreeDevice& device = rig.devices[d];
            const EmbreeTree kind = kinds[i].tree;
            methods.push_back({fmt::format("{}, {})", kinds[i].name, device.isa()),
                               [&tree] { tree.reset(); },
                               [&, kind] { tree.emplace(device, mesh, kind); }});
        }
    }
    const std::vector<Samples> samples = time_interleaved(methods, rig.repeat);

    for (std::size_t i = 0; i < builds.size(); ++i) {
        for (std::size_t k = 0; k < std::size(kinds); ++k) {
            const std::size_t first = builds.size() + k * devices;
            const std::size_t best = fastest(std::span(samples).subspan(first, devices));
            Row row = row_of(rig, scene, "build");
            row.tracer = builds[i].name;
            row.target = builds[i].target;
            row.peer = methods[first + best].name;
            row.mismatches = compare_trees(arena, primary, mine[i], *theirs[k][best]);
            set_times(row, times_of(samples[i]), times_of(samples[first + best]), Unit::kMs,
                      row.triangles);
            rig.report(row);
        }
    }
}

}  // namespace mray::bench
