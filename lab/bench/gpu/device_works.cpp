#include <fmt/format.h>

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
    std::vector<Hit> hits(diffuse.rays.size());
    // `ms` is ours; there are no hits where any will do.
    const auto compare = [&](RayKind kind, std::uint64_t rays, std::uint32_t mode,
                             double BackendTimes::*ms, std::span<const Hit> found) {
        const auto trace = [&](std::size_t) {
            if (kind == RayKind::kDiffuse) {
                ours->trace({diffuse.rays, hits});
            } else {
                trace_image(kind == RayKind::kShadow ? kRaysShadow : kRaysPrimary, false);
            }
            return ours->finish().*ms;
        };
        const auto count_differences = [&] {
            std::vector<Hit> theirs(found.size());
            if (!found.empty()) peer.read_hits(theirs);
            return count_other_triangles(found, theirs);
        };
        const Method methods[] = {
            {"vulkan", {}, trace},
            {"bvh2", {}, [&](std::size_t) { return peer.trace(mode); }, "", count_differences}};
        report.compare({name_of(kind), kMrayPerSecond, rays}, methods, 1, repeat);
    };
    compare(RayKind::kPrimary, seen.hits.size(), kPeerCamera, &BackendTimes::trace_ms, seen.hits);
    compare(RayKind::kShadow, count_hits(seen), kPeerShadow, &BackendTimes::secondary_ms, {});
    compare(RayKind::kDiffuse, diffuse.active_count, kPeerRays, &BackendTimes::trace_ms, hits);
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
