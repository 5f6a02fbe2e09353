#include <fmt/format.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "common/scene/pose.h"
#include "common/version.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/options.h"
#include "lab/methods/gpu_peer.h"
#include "lab/methods/report.h"

namespace mray::lab {
namespace {

void bench_scene(const BenchScene& scene, int repeat, Report& report) {
    const Pose pose(scene.positions);
    const PeerTree tree = build_peer_tree(scene.topology(), scene.positions, 1.5, 4);
    const RaySet diffuse = scene.rays(RayKind::kDiffuse);
    const auto shared = gpu::open_device({});
    const std::unique_ptr<Backend> ours = gpu::make_backend_on(shared);
    ours->set_scene(scene.topology(), pose, scene.bvh);
    GpuPeer peer(shared, tree, scene.params, diffuse.rays.size());
    peer.set_rays(diffuse.rays);
    const auto compare = [&](const char* work, std::uint64_t rays, std::uint32_t mode,
                             const std::function<double()>& trace, std::span<const Hit> hits) {
        const auto count_differences = [&] {
            std::vector<Hit> theirs(hits.size());
            if (!hits.empty()) peer.read_hits(theirs);
            return count_other_triangles(hits, theirs);
        };
        const Method methods[] = {
            {"vulkan", {}, [&](std::size_t) { return trace(); }},
            {"bvh2", {}, [&](std::size_t) { return peer.trace(mode); }, "", count_differences}};
        report.compare({work, kMrayPerSecond, rays}, methods, 1, repeat);
    };
    const auto trace_image = [&](std::uint32_t rays, bool with_hits) {
        ImageParams params = scene.params;
        params.rays = rays;
        Frame frame;
        frame.with_pixels = false;
        frame.with_hits = with_hits;
        ours->trace_image(params, frame);
        return frame;
    };
    const Frame seen = trace_image(kRaysPrimary, true);
    compare(
        "primary", seen.hits.size(), kPeerCamera,
        [&] {
            trace_image(kRaysPrimary, false);
            return ours->finish().trace_ms;
        },
        seen.hits);
    compare("shadow", count_hits(seen), kPeerShadow,
            [&] {
                trace_image(kRaysShadow, false);
                return ours->finish().secondary_ms;
            },
            {});
    std::vector<Hit> hits(diffuse.rays.size());
    compare(
        "diffuse", diffuse.active_count, kPeerRays,
        [&] {
            ours->trace({diffuse.rays, hits});
            return ours->finish().trace_ms;
        },
        hits);
}

}  // namespace

int bench_on_device(const BenchOptions& options) {
    Report report(
        fmt::format("# {}, {}; morphray {}\n# morphray_bench device {}\n", machine_name(),
                    gpu::make_vulkan_backend()->info().description, kVersionDetail, options.line),
        options.csv);
    for (const std::string& spec : options.scenes) {
        const BenchScene scene = open_bench_scene(spec, options.size);
        report.begin(spec, 1);
        bench_scene(scene, options.repeat, report);
    }
    return 0;
}

}  // namespace mray::lab
