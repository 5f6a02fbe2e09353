// morphray_gpu_model [--card NAME] [--size SIDE] SCENE[,DISTANCE]...: what kernels would take on a
// GPU, by counts of what warps of sampled rays do, as comma-separated values. The view is that of
// the benchmark with SIDE pixels; or all of the scene from DISTANCE times the default eye's,
// 1920x1080.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "common/interop/surface.h"
#include "cpu/reference/scalar_tracer.h"
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

/// The costs of a step in the kernels of 79d57a95, in the present ones and in the peer's, by
/// StepKind. The notes say how they were found.
constexpr StepCost kSteps[kStepKinds][3] = {
    {{290, 137, 1}, {290, 136, 1}, {40, 10, 1}},  // kBegin
    {{547, 225, 2}, {124, 57, 1}, {61, 24, 1}},   // kNode
    {{}, {116, 60, 1}, {}},                       // kQuarter
    {{}, {8, 0, 1}, {}},                          // kChildren
    {{}, {5, 0, 0}, {}},                          // kChild
    {{}, {5, 0, 0}, {4, 0, 0}},                   // kPush
    {{12, 0, 1}, {12, 0, 1}, {6, 0, 1}},          // kPop
    {{30, 1, 1}, {27, 0, 1}, {6, 0, 0}},          // kLeaf
    {{}, {117, 57, 1}, {}},                       // kGroups
    {{112, 53, 2}, {109, 49, 2}, {66, 37, 2}},    // kTriangle
    {{153, 71, 2}, {99, 46, 1}, {}},              // kHit
    {{609, 454, 2}, {720, 550, 2}, {}},           // kOpen
};

KernelCost kernel_of(std::string_view name, double registers, double ray_bytes, double cycles_alone,
                     std::size_t column) {
    KernelCost kernel{name, registers, ray_bytes, cycles_alone, {}};
    for (std::size_t i = 0; i < kStepKinds; ++i) kernel.steps[i] = kSteps[i][column];
    return kernel;
}
const KernelCost kFirst = kernel_of("79d57a95", 128, 16, 1.5, 0);
const KernelCost kPresent = kernel_of("present", 64, 16, 1.5, 1);
const KernelCost kPeer = kernel_of("bvh2", 56, 96, 2, 2);

enum class Rays { kCamera, kShadow, kOcclusion, kDiffuse };
constexpr std::string_view kRayNames[] = {"primary", "shadow", "ao", "diffuse"};
constexpr std::uint32_t kAoSamples = 4;

struct SampledWarp {
    std::vector<Ray> rays;
    /// The share of the image that comes before it.
    double place;
};

std::vector<Ray> rays_of_pixel(const BenchScene& scene, Rays kind, const Ray& camera,
                               std::uint32_t x, std::uint32_t y) {
    if (kind == Rays::kCamera) return {camera};
    const Hit hit = cpu::ScalarTracer(scene.bvh).intersect(camera);
    if (hit.prim_id == kNoPrim) return {};
    const uvec3 t = scene.topology().triangles[hit.prim_id];
    const std::vector<vec3>& at = scene.positions;
    const Surface s = surface_at(camera, hit, at[t.x], at[t.y], at[t.z]);
    std::vector<Ray> rays;
    if (kind == Rays::kShadow && faces_light(s, scene.params.light))
        rays.push_back(shadow_ray(s, scene.params.light));
    for (std::uint32_t k = 0; kind == Rays::kOcclusion && k < kAoSamples; ++k)
        rays.push_back(ao_ray(s, x, y, k, scene.params.ao_tfar));
    if (kind == Rays::kDiffuse) rays.push_back(ao_ray(s, x, y, 0, kInfiniteT));
    for (Ray& ray : rays) ray.tfar = std::min(ray.tfar, kInfiniteT);
    return rays;
}

/// One tile of so many is traced. Fewer miss the longest warps.
constexpr std::uint32_t kTileStep = 7;

std::vector<SampledWarp> sample_warps(const BenchScene& scene, Rays kind) {
    const ImageParams& params = scene.params;
    const std::uint32_t columns = params.width / 8;
    const std::uint32_t tiles = columns * (params.height / 8);
    std::vector<SampledWarp> warps;
    for (std::uint32_t tile = kTileStep / 2; tile < tiles; tile += kTileStep) {
        std::vector<Ray> rays;
        for (std::uint32_t lane = 0; lane < 64; ++lane) {
            // As tile_pixel() of shaders/kernel.glsl.
            const std::uint32_t x = tile % columns * 8 + ((lane & 3) | (lane >> 1 & 4));
            const std::uint32_t y = tile / columns * 8 + ((lane >> 2 & 1) | (lane >> 3 & 6));
            const Ray camera = camera_ray(params.camera, x, y);
            for (const Ray& ray : rays_of_pixel(scene, kind, camera, x, y)) rays.push_back(ray);
        }
        for (std::size_t i = 0; i < rays.size(); i += kWarpLanes)
            warps.push_back({{rays.begin() + static_cast<std::ptrdiff_t>(i),
                              rays.begin() + static_cast<std::ptrdiff_t>(
                                                 std::min(i + kWarpLanes, rays.size()))},
                             static_cast<double>(tile) / tiles});
    }
    return warps;
}

struct Form {
    const KernelCost& kernel;
    /// Pixels of a region, and the most rays of a dispatch.
    double region;
    double scene_bytes;
    std::function<WarpTrace(std::span<const Ray>)> trace;
};

/// Microseconds of what stands beside a region's rays: fills, barriers and copies. Assumed.
constexpr double kGapUs = 6;

/// Microseconds of all regions of an image and of their dispatches.
double image_us(const Card& card, const Form& form, const Pass& pass,
                std::span<const SampledWarp> warps, double pixels) {
    double us = 0;
    for (double begin = 0; begin < pixels; begin += form.region) {
        std::vector<WarpLoad> loads;
        double rays = 0;
        for (std::size_t i = 0; i < warps.size(); ++i) {
            const double place = warps[i].place * pixels - begin;
            if (place < 0 || place >= form.region) continue;
            loads.push_back(pass.warps[i]);
            rays += kTileStep * static_cast<double>(warps[i].rays.size());
        }
        // Where no ray starts, the pixels have been looked at.
        us += kGapUs;
        const double warps_a_ray = kTileStep * static_cast<double>(loads.size()) / rays;
        for (double left = rays; left >= 1; left -= form.region)
            us += dispatch_us(card, pass.warps_in_flight, loads,
                              std::ceil(std::min(left, form.region) * warps_a_ray));
    }
    return us;
}

/// Prints a line of the table.
void model(const Card& card, const Form& form, std::span<const SampledWarp> warps, double pixels) {
    std::vector<WarpTrace> traces(warps.size());
    WarpTrace sum;
    double steps = 0;
    double active = 0;
    tbb::parallel_for(std::size_t{0}, warps.size(),
                      [&](std::size_t i) { traces[i] = form.trace(warps[i].rays); });
    for (const WarpTrace& trace : traces) {
        sum.rays += trace.rays;
        sum.boxes += trace.boxes;
        sum.triangles += trace.triangles;
        sum.open_rays += trace.open_rays;
        sum.open_triangles += trace.open_triangles;
        steps += static_cast<double>(trace.steps.size());
        for (const Step& step : trace.steps) active += step.active;
    }
    const Pass pass = load_warps(card, form.kernel, traces, form.scene_bytes);
    double us = image_us(card, form, pass, warps, pixels);
    // `decide`, whose warps are full, writes and reads 64 bytes for each ray.
    const double decided =
        sum.open_triangles * kTileStep / card.units * form.kernel.steps[11].instructions;
    if (sum.open_rays > 0)
        us += kGapUs + decided / kWarpLanes / card.issued / card.ghz / 1e3 +
              sum.open_rays * kTileStep * 128 / card.dram_tb_s / 1e6;
    WarpLoad mean;
    for (const WarpLoad& load : pass.warps) mean.add(load, static_cast<double>(warps.size()));
    const double rays = sum.rays;
    fmt::print(
        ",{},{:.0f},{:.0f},{:.1f},{:.1f},{:.2f},{:.1f},{:.0f},{:.0f},{:.0f},{:.0f},{:.0f},{:.0f}\n",
        form.kernel.name, rays * kTileStep / us, us, sum.boxes / rays, sum.triangles / rays,
        sum.open_rays / rays, active / steps, pass.warps_in_flight, mean.issue, mean.l1, mean.l2,
        mean.dram, mean.alone);
}

/// The scene in the benchmark's view of `side` pixels; or with `distance`, whole in 1920x1080.
BenchScene open(const std::string& spec, std::uint32_t side, double distance) {
    ViewSpec view;
    view.width = view.height = kTileSize;
    BenchScene scene = open_bench_scene(spec, view);
    ImageParams& params = scene.params;
    if (distance == 0) {
        params.camera.du *= static_cast<float>(kTileSize) / static_cast<float>(side);
        params.camera.dv *= static_cast<float>(kTileSize) / static_cast<float>(side);
        params.width = params.height = side;
        return scene;
    }
    view.width = 1920;
    view.height = 1080;
    const WorldBounds bounds = scene.animation->bounds();
    const ResolvedView whole = resolve_view(view, bounds);
    const glm::dvec3 target = to_dvec3(whole.target);
    view.target = whole.target;
    view.eye = to_point(target + distance * (to_dvec3(whole.eye) - target));
    params = make_image_params(view, bounds, scene.space);
    return scene;
}

void model_scene(const Card& card, const BenchScene& scene, const std::string& name) {
    const PeerTree tree = build_peer_tree(scene.topology(), scene.positions, 1, 4);
    const auto size = [](const auto& items) { return static_cast<double>(items.size()); };
    const double bytes =
        sizeof(Node) * size(scene.bvh.nodes) + sizeof(Leaf) * size(scene.bvh.leaves);
    const double boxes = 96 * (size(scene.bvh.nodes) + size(scene.bvh.leaves));
    const double pixels = double{1} * scene.params.width * scene.params.height;
    for (std::size_t kind = 0; kind < std::size(kRayNames); ++kind) {
        const bool any_hit = kRayNames[kind] == "shadow" || kRayNames[kind] == "ao";
        const auto ours = [&](KernelForm form) {
            return [&, form](std::span<const Ray> rays) {
                return trace_warp(scene.bvh, rays, any_hit, form);
            };
        };
        const Form forms[] = {
            {kFirst, 0x1p18, bytes, ours(KernelForm::kFirst)},
            {kPresent, 0x1p21, bytes + boxes, ours(KernelForm::kPresent)},
            {kPeer, 0x1p30, 64 * size(tree.nodes) + 52 * size(tree.triangles),
             [&](std::span<const Ray> rays) { return trace_warp(tree, rays, any_hit); }}};
        const std::vector<SampledWarp> warps = sample_warps(scene, Rays(kind));
        for (const Form& form : forms) {
            fmt::print("{},{},{}", card.name, name, kRayNames[kind]);
            model(card, form, warps, pixels);
        }
    }
}

void run(std::span<const std::string> arguments) {
    const Card* card = &kCards[0];
    std::uint32_t side = 1440;
    fmt::print("card,scene,rays,kernel,mray_s,us,boxes,triangles,open,active,warps,{}\n",
               "issue,l1,l2,dram,alone");
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const bool has_next = i + 1 < arguments.size();
        if (arguments[i] == "--card" && has_next) {
            card = std::ranges::find(kCards, std::string_view(arguments[++i]), &Card::name);
            if (card == std::end(kCards)) throw std::invalid_argument("unknown card");
        } else if (arguments[i] == "--size" && has_next) {
            side = static_cast<std::uint32_t>(std::stoul(arguments[++i]));
        } else {
            const std::size_t comma = std::min(arguments[i].find(','), arguments[i].size());
            const std::string spec = arguments[i].substr(0, comma);
            const bool is_whole = comma < arguments[i].size();
            const double distance = is_whole ? std::stod(arguments[i].substr(comma + 1)) : 0;
            model_scene(*card, open(spec, side, distance), spec);
        }
    }
}

}  // namespace
}  // namespace mray::lab

int main(int argc, char** argv) {
    try {
        mray::lab::run(std::vector<std::string>(argv + 1, argv + argc));
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "morphray_gpu_model: {}\n", error.what());
        return 2;
    }
}
