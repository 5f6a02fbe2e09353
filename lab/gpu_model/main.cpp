// morphray_gpu_model [--card NAME] [--size SIDE] [--distance TIMES] SCENE...: what kernels would
// take on a GPU, by counts of what warps of sampled rays do, as comma-separated values. The view is
// that of the benchmark with SIDE pixels; or all of the scene from so many times the default eye's
// distance, 1920x1088.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <stdexcept>

#include "lab/bench/bench_scene.h"
#include "lab/gpu_model/gpu_time.h"

namespace mray::lab {
namespace {

// Figures of their makers, and latencies as measured by others.
constexpr Card kCards[] = {
    {"H100", 132, 1.98, 4, 2, 65536, 64, 224e3, 1, 50e6, 5.6, 3.35, 33, 260, 600},
    {"H200", 132, 1.98, 4, 2, 65536, 64, 224e3, 1, 50e6, 5.6, 4.8, 33, 260, 600},
    // RX 6800 XT: compute units of two vector units of 32 lanes; the last cache counts as memory.
    {"RX6800XT", 72, 2.25, 2, 2, 65536, 32, 16e3, 0.5, 4e6, 3.0, 1.6, 60, 190, 320},
};

constexpr KernelForm kForms[] = {{Kernel::kFirst, "79d57a95", 128, 16, 1.5, 0x1p18},
                                 {Kernel::kPresent, "present", 64, 16, 1.5, 0x1p21},
                                 {Kernel::kPeer, "bvh2", 56, 96, 2, 0x1p30}};

struct SampledWarp {
    std::span<const Ray> rays;
    /// The tile of the image.
    std::size_t tile;
};

/// One warp of so many is traced. Fewer miss the longest ones.
constexpr std::uint32_t kStride = 7;
constexpr double kTilePixels = kTileSize * kTileSize;
/// Microseconds of what stands beside a region's rays: fills, barriers and copies. Assumed.
constexpr double kGapUs = 6;
/// Of the whole rule, by which `decide` decides a triangle.
constexpr double kDecideInstructions = 720;

/// Takes the inactive rays out of a set, and warps from the others.
std::vector<SampledWarp> sample_warps(RaySet& set) {
    std::vector<SampledWarp> warps;
    std::size_t number = kStride / 2;
    for (std::size_t tile = 0; tile < set.tiles.size(); ++tile) {
        const std::size_t begin = set.tiles[tile].begin;
        std::size_t end = begin;
        for (std::size_t i = begin; i < set.tiles[tile].end; ++i)
            if (set.active[i] != 0) set.rays[end++] = set.rays[i];
        for (std::size_t i = begin; i < end; i += kWarpLanes, ++number)
            if (number % kStride == 0)
                warps.push_back({{&set.rays[i], std::min<std::size_t>(kWarpLanes, end - i)}, tile});
    }
    return warps;
}

/// Microseconds of all regions of an image and of their dispatches.
double image_us(const Card& card, const KernelForm& form, std::span<const SampledWarp> warps,
                std::span<const WarpLoad> loads, double pixels) {
    double us = 0;
    std::size_t begin = 0;
    for (double region_end = form.region; begin < warps.size(); region_end += form.region) {
        double rays = 0;
        std::size_t end = begin;
        for (; end < warps.size() && double(warps[end].tile) * kTilePixels < region_end; ++end)
            rays += kStride * static_cast<double>(warps[end].rays.size());
        const double warps_a_ray = kStride * static_cast<double>(end - begin) / rays;
        for (double left = rays; left >= 1; left -= form.region)
            us += dispatch_us(card, warps_in_flight(card, form), loads.subspan(begin, end - begin),
                              std::ceil(std::min(left, form.region) * warps_a_ray));
        begin = end;
    }
    // Where no ray starts, the pixels have been looked at.
    return us + kGapUs * std::ceil(pixels / form.region);
}

void print_row(const Card& card, const KernelForm& form, const BenchScene& scene,
               const PeerTree& peer, const RaySet& set, std::span<const SampledWarp> warps) {
    const auto size = [](const auto& items) { return static_cast<double>(items.size()); };
    const double nodes = size(scene.bvh.nodes);
    const double leaves = size(scene.bvh.leaves);
    double bytes = sizeof(Node) * nodes + sizeof(Leaf) * leaves;
    if (form.kernel == Kernel::kPresent) bytes += 96 * (nodes + leaves);
    if (form.kernel == Kernel::kPeer) bytes = 64 * size(peer.nodes) + 52 * size(peer.triangles);
    std::vector<WarpTrace> traces(warps.size());
    tbb::parallel_for(std::size_t{0}, warps.size(), [&](std::size_t i) {
        traces[i] = trace_warp(form.kernel, scene.bvh, peer, warps[i].rays, set.any_hit());
    });
    double rays = 0, boxes = 0, open = 0, steps = 0, active = 0;
    for (std::size_t i = 0; i < warps.size(); ++i) {
        rays += static_cast<double>(warps[i].rays.size());
        boxes += traces[i].boxes;
        open += traces[i].open;
        steps += static_cast<double>(traces[i].steps.size());
        for (const Step& step : traces[i].steps) active += step.active;
    }
    const std::vector<WarpLoad> loads = load_warps(card, form, traces, bytes);
    double us = image_us(card, form, warps, loads, kTilePixels * double(set.tiles.size()));
    // `decide`, whose warps are full, writes and reads 64 bytes for each triangle.
    const double issue = kDecideInstructions / kWarpLanes / card.issued / card.units / card.ghz;
    if (open > 0) us += kGapUs + open * kStride * (issue / 1e3 + 128 / card.dram_tb_s / 1e6);
    const WarpLoad mean = mean_of(loads);
    fmt::print("{},{},{},{},{:.0f},{:.0f},{:.1f},{:.2f},{:.1f},{:.0f},{:.0f}\n", card.name,
               scene.name, name_of(set.kind), form.name, rays * kStride / us, us, boxes / rays,
               open / rays, active / steps, fmt::join(mean.parts, ","), mean.alone);
}

BenchScene open(const std::string& spec, std::uint32_t side, double distance) {
    if (side % kTileSize != 0) throw std::invalid_argument("--size: not a multiple of 64");
    BenchScene scene = open_bench_scene(spec, distance == 0 ? side : kTileSize);
    if (distance == 0) return scene;
    ViewSpec view;
    view.width = 1920;
    view.height = 1088;
    const WorldBounds bounds = scene.animation->bounds();
    const ResolvedView whole = resolve_view(view, bounds);
    const glm::dvec3 target = to_dvec3(whole.target);
    view.target = whole.target;
    view.eye = to_point(target + distance * (to_dvec3(whole.eye) - target));
    scene.params = make_image_params(view, bounds, scene.space);
    scene.primary = make_primary_rays(scene.params);
    scene.hits = trace_all(reference_tracer(scene.bvh, scene.primary), scene.primary).hits;
    return scene;
}

void model(const Card& card, const BenchScene& scene) {
    const PeerTree peer = build_peer_tree(scene.topology(), scene.positions, 1, 4);
    for (const RayKind kind :
         {RayKind::kPrimary, RayKind::kShadow, RayKind::kAo, RayKind::kDiffuse}) {
        RaySet set = kind == RayKind::kPrimary
                         ? scene.primary
                         : make_secondary_rays(scene.primary, scene.hits,
                                               {&scene.topology(), scene.positions}, kind, 4);
        const std::vector<SampledWarp> warps = sample_warps(set);
        for (const KernelForm& form : kForms) print_row(card, form, scene, peer, set, warps);
    }
}

}  // namespace
}  // namespace mray::lab

int main(int argc, char** argv) {
    using namespace mray::lab;
    CLI::App app("What kernels would take on a GPU.");
    std::string name = "H100";
    std::uint32_t side = 1408;
    double distance = 0;
    std::vector<std::string> scenes;
    app.add_option("--card", name)->check(CLI::IsMember({"H100", "H200", "RX6800XT"}));
    app.add_option("--size", side);
    app.add_option("--distance", distance);
    app.add_option("scenes", scenes)->required();
    try {
        app.parse(argc, argv);
        fmt::print("card,scene,rays,kernel,mray_s,us,boxes,open,active,issue,l1,l2,dram,alone\n");
        for (const std::string& scene : scenes)
            model(*std::ranges::find(kCards, name, &Card::name), open(scene, side, distance));
        return 0;
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const std::exception& error) {
        fmt::print(stderr, "morphray_gpu_model: {}\n", error.what());
        return 2;
    }
}
