// morphray on a Vulkan device beside the peer on the same device: camera, shadow and diffuse rays,
// by the device's clock. Scenes, --repeat, --size, and --csv are those of lab/bench/run. `differ`
// counts rays that hit another triangle than by the peer's rule.
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
#include "lab/methods/tracers.h"

namespace mray::lab {
namespace {

std::uint64_t pixels_of(const ImageParams& params) {
    return std::uint64_t{params.width} * params.height;
}

class VulkanBench {
public:
    VulkanBench(const BenchScene& scene, int repeat, Report& report)
        : scene_(scene),
          repeat_(repeat),
          report_(report),
          pose_(scene.positions),
          tree_(build_peer_tree(scene.topology(), scene.positions, 1.5, 4)),
          diffuse_(diffuse_rays()),
          shared_(gpu::open_device({})),
          ours_(gpu::make_backend_on(shared_)),
          peer_(shared_, tree_, scene.params, diffuse_.size()) {
        peer_.set_rays(diffuse_);
        ours_->set_scene(scene.topology(), pose_, scene.bvh);
    }

    void run() {
        trace("primary", kRaysPrimary, kPeerCamera);
        trace("shadow", kRaysShadow, kPeerShadow);
        trace_diffuse();
    }

private:
    std::vector<Ray> diffuse_rays() const {
        const RaySet set = SceneRays(scene_).rays(RayKind::kDiffuse);
        std::vector<Ray> rays;
        for (std::size_t i = 0; i < set.rays.size(); ++i)
            if (set.active[i] != 0) rays.push_back(set.rays[i]);
        return rays;
    }

    std::uint64_t count_differences(std::span<const Hit> ours) {
        std::vector<Hit> hits(ours.size());
        peer_.read_hits(hits);
        return count_other_triangles(ours, hits);
    }

    void compare(const char* work, std::uint64_t rays, const std::function<double()>& ours,
                 std::uint32_t mode, const std::function<std::uint64_t()>& differences) {
        const Method methods[] = {
            {"vulkan", {}, [&](std::size_t) { return ours(); }},
            {"bvh2", {}, [&](std::size_t) { return peer_.trace(mode); }, "", differences}};
        report_.compare({work, Unit::kMrayPerSecond, rays}, methods, 1, repeat_);
    }

    void trace(const char* work, std::uint32_t rays, std::uint32_t mode) {
        ImageParams params = scene_.params;
        params.rays = rays;
        Frame checked;
        checked.with_pixels = false;
        ours_->trace_image(params, checked);
        Frame frame;
        frame.with_pixels = false;
        frame.with_hits = false;
        const bool is_primary = rays == kRaysPrimary;
        const auto ours = [&] {
            ours_->trace_image(params, frame);
            const BackendTimes& t = ours_->finish();
            return is_primary ? t.trace_ms : t.secondary_ms;
        };
        const std::uint64_t ray_count =
            is_primary ? pixels_of(params)
                       : count_hits(checked) * rays_per_hit(rays, params.ao_count);
        compare(work, ray_count, ours, mode,
                [&] { return is_primary ? count_differences(checked.hits) : 0; });
    }

    void trace_diffuse() {
        std::vector<Hit> hits(diffuse_.size());
        const auto ours = [&] {
            ours_->trace({diffuse_, hits});
            return ours_->finish().trace_ms;
        };
        compare("diffuse", hits.size(), ours, kPeerRays, [&] { return count_differences(hits); });
    }

    const BenchScene& scene_;
    int repeat_;
    Report& report_;
    Pose pose_;
    PeerTree tree_;
    std::vector<Ray> diffuse_;
    std::shared_ptr<gpu::SharedDevice> shared_;
    std::unique_ptr<Backend> ours_;
    GpuPeer peer_;
};

int run(const BenchOptions& options) {
    Report report(
        fmt::format("# {}, {}; morphray {}\n# morphray_gpu_bench {}\n", machine_name(),
                    gpu::make_vulkan_backend()->info().description, kVersionDetail, options.line),
        options.csv);
    for (const std::string& spec : options.scenes) {
        const BenchScene scene = open_bench_scene(spec, options.view);
        report.begin(spec, 1);
        VulkanBench(scene, options.repeat, report).run();
    }
    return 0;
}

}  // namespace
}  // namespace mray::lab

int main(int argc, char** argv) {
    using namespace mray::lab;
    return bench_main(BenchProgram::kRun, argc, argv, run);
}
