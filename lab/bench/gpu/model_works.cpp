#include <fmt/format.h>

#include "lab/bench/bench_scene.h"
#include "lab/bench/options.h"
#include "lab/gpu_model/gpu_time.h"

namespace mray::lab {
namespace {

// Figures of their makers, and latencies as measured by others.
const Card kCards[] = {
    {"H100", 132, 1.98, 4, 2, 65536, 64, 224e3, 1, 50e6, 5.6, 3.35, 33, 260, 600},
    {"H200", 132, 1.98, 4, 2, 65536, 64, 224e3, 1, 50e6, 5.6, 4.8, 33, 260, 600},
    // RX 6800 XT: compute units of two vector units of 32 lanes; the last cache counts as memory.
    {"RX6800XT", 72, 2.25, 2, 2, 65536, 32, 16e3, 0.5, 4e6, 3.0, 1.6, 60, 190, 320},
};

// By RADV's code; the notes say how the costs were found.
const Kernel kPresent = {"present",
                         64,
                         16,
                         1.5,
                         {290, 124, 124, 10, 12, 27, 117, 109, 99},
                         {136, 57, 60, 0, 0, 0, 57, 49, 46},
                         {1, 1, 2, 0, 1, 1, 1, 2, 1}};
const Kernel kPeer = {"bvh2",
                      56,
                      96,
                      2,
                      {40, 61, 0, 4, 6, 6, 0, 66},
                      {10, 24, 0, 0, 0, 0, 0, 37},
                      {1, 1, 0, 0, 1, 0, 0, 2}};

/// One warp of so many is traced. Fewer miss the longest ones.
constexpr std::size_t kStride = 7;
/// Microseconds of what stands beside an image's rays: fills, barriers and copies. Assumed.
constexpr double kGapUs = 6;
/// Of the whole rule, by which `decide` decides a triangle.
constexpr double kDecideInstructions = 720;

/// Takes the inactive rays out of a set, and warps from the others.
std::vector<std::span<const Ray>> sample_warps(RaySet& set) {
    std::vector<std::span<const Ray>> warps;
    std::size_t number = kStride / 2;
    for (const TileRays& tile : set.tiles) {
        std::size_t end = tile.begin;
        for (std::size_t i = tile.begin; i < tile.end; ++i)
            if (set.active[i] != 0) set.rays[end++] = set.rays[i];
        for (std::size_t i = tile.begin; i < end; i += kWarpLanes, ++number)
            if (number % kStride == 0)
                warps.emplace_back(&set.rays[i], std::min<std::size_t>(kWarpLanes, end - i));
    }
    return warps;
}

/// What a kernel would take for an image of one dispatch.
template <class Tree>
void print_row(const Card& card, const Kernel& kernel, const Tree& tree, double bytes,
               const std::string& scene, const RaySet& set,
               std::span<const std::span<const Ray>> warps) {
    std::vector<WarpTrace> traces(warps.size());
    tbb::parallel_for(std::size_t{0}, warps.size(), [&](std::size_t i) {
        traces[i] = trace_warp(tree, warps[i], set.any_hit());
    });
    double rays = 0, boxes = 0, open = 0, steps = 0, active = 0;
    for (std::size_t i = 0; i < warps.size(); ++i) {
        rays += double(warps[i].size());
        boxes += traces[i].boxes;
        open += traces[i].open;
        steps += double(traces[i].steps.size());
        for (const Step& step : traces[i].steps) active += double(step.active);
    }
    const std::vector<WarpLoad> loads = load_warps(card, kernel, traces, bytes);
    double us = kGapUs + dispatch_us(card, warps_in_flight(card, kernel), loads,
                                     double(kStride * warps.size()));
    // `decide`, whose warps are full, writes and reads 64 bytes for each triangle.
    const double issue = kDecideInstructions / kWarpLanes / card.issued / card.units / card.ghz;
    if (open > 0) us += kGapUs + open * kStride * (issue / 1e3 + 128 / card.dram_tb_s / 1e6);
    const WarpLoad mean = mean_of(loads);
    const std::span parts(&mean.parts.x, 4);
    fmt::print("{},{},{},{},{:.0f},{:.0f},{:.1f},{:.2f},{:.1f},{:.0f},{:.0f}\n", card.name, scene,
               name_of(set.kind), kernel.name, rays * kStride / us, us, boxes / rays, open / rays,
               active / steps, fmt::join(parts, ","), mean.alone);
}

}  // namespace

int model_gpu(const BenchOptions& options) {
    const Card& card = *std::ranges::find(kCards, options.card, &Card::name);
    fmt::print("card,scene,rays,kernel,mray_s,us,boxes,open,active,issue,l1,l2,dram,alone\n");
    for (const std::string& spec : options.scenes) {
        const BenchScene scene = open_bench_scene(spec, options.size, options.distance);
        const PeerTree peer = build_peer_tree(scene.topology(), scene.positions, 1, 4);
        const auto nodes = double(scene.bvh.nodes.size());
        const auto leaves = double(scene.bvh.leaves.size());
        // With the boxes of quarters and groups.
        const double bytes = (96 + sizeof(Node)) * nodes + (96 + sizeof(Leaf)) * leaves;
        const double peer_bytes =
            64 * double(peer.nodes.size()) + 52 * double(peer.triangles.size());
        for (const RayKind kind : kAllKinds) {
            if (kind == RayKind::kOneRay) continue;
            RaySet set = scene.rays(kind);
            const auto warps = sample_warps(set);
            print_row(card, kPresent, scene.bvh, bytes, spec, set, warps);
            print_row(card, kPeer, peer, peer_bytes, spec, set, warps);
        }
    }
    return 0;
}

}  // namespace mray::lab
