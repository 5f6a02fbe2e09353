// morphray on a Vulkan device beside the peer on the same device: camera, shadow and diffuse rays,
// and a refit beside a copy of as many bytes, by the device's clock. Scenes, --repeat, --size, and
// --csv are those of lab/bench/run. `differ` counts rays that hit another triangle than by the
// peer's rule.
#include <fmt/format.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/version.h"
#include "gpu/shared_device.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/gpu/peer_tracer.h"
#include "lab/bench/options.h"
#include "lab/bench/ours.h"
#include "lab/bench/report.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {
namespace {

class VulkanBench {
public:
    VulkanBench(const BenchScene& scene, int repeat, Report& report)
        : scene_(scene),
          repeat_(repeat),
          report_(report),
          tree_(build_peer_tree(scene.topology(), scene.positions, {1.5, 4})),
          diffuse_(diffuse_rays()),
          shared_(gpu::open_device({})),
          ours_(gpu::make_backend_on(shared_)),
          peer_(shared_, tree_, scene.params, diffuse_) {
        ours_->set_scene(scene.topology(), scene.positions, scene.bvh);
    }

    void run() {
        trace("primary", kRaysPrimary, kPeerCamera);
        trace("shadow", kRaysShadow, kPeerShadow);
        trace_diffuse();
        refit();
    }

private:
    std::vector<Ray> diffuse_rays() const {
        const TraceWork work = SceneRays(scene_).work(WorkKind::kDiffuse);
        std::vector<Ray> rays;
        for (std::size_t i = 0; i < work.rays.size(); ++i)
            if (work.active[i] != 0) rays.push_back(work.rays[i]);
        return rays;
    }

    std::uint64_t pixels() const {
        return std::uint64_t{scene_.params.width} * scene_.params.height;
    }

    /// Times both in turn.
    using Run = std::function<double(std::size_t)>;
    std::vector<Times> time(const Run& ours, const char* peer, const Run& theirs) const {
        return time_in_turn(std::vector<Method>{{"vulkan", {}, ours}, {peer, {}, theirs}}, 1,
                            repeat_);
    }

    void report(const char* work, const char* peer, std::span<const Times> times, Unit unit,
                std::uint64_t count, std::uint64_t differences) const {
        Row row{.work = work, .tracer = "vulkan", .peer = peer};
        row.differences = differences;
        set_times(row, times[0], times[1], unit, count);
        report_.add(row);
    }

    static std::uint64_t count_mismatches(std::span<const Hit> ours, std::span<const Hit> theirs) {
        std::uint64_t count = 0;
        for (std::size_t i = 0; i < theirs.size(); ++i)
            count += ours[i].prim_id != theirs[i].prim_id;
        return count;
    }

    void trace(const char* work, std::uint32_t rays, std::uint32_t mode) {
        ImageParams params = scene_.params;
        params.rays = rays;
        Frame frame;
        frame.with_pixels = false;
        frame.with_hits = false;
        const auto ours = [&](std::size_t) {
            ours_->trace_image(params, frame);
            const BackendTimes& t = ours_->finish();
            return rays == kRaysPrimary ? t.trace_ms : t.secondary_ms;
        };
        const std::vector<Times> times =
            time(ours, kPeer, [&](std::size_t) { return peer_.trace(mode); });
        frame.with_hits = true;
        ours_->trace_image(params, frame);
        const bool is_primary = rays == kRaysPrimary;
        const std::uint64_t ray_count =
            is_primary ? pixels() : count_hits(frame) * rays_per_hit(rays, params.ao_count);
        report(work, kPeer, times, Unit::kMrayPerSecond, ray_count,
               is_primary ? count_mismatches(frame.hits, peer_.hits(pixels())) : 0);
    }

    void trace_diffuse() {
        std::vector<Hit> hits(diffuse_.size());
        const auto ours = [&](std::size_t) {
            ours_->trace({diffuse_, hits});
            return ours_->finish().trace_ms;
        };
        const std::vector<Times> times =
            time(ours, kPeer, [&](std::size_t) { return peer_.trace(kPeerRays); });
        report("diffuse", kPeer, times, Unit::kMrayPerSecond, hits.size(),
               count_mismatches(hits, peer_.hits(hits.size())));
    }

    /// Bytes that a refit reads and writes, half of which a copy reads, and half of which it
    /// writes.
    std::uint64_t refit_bytes() const {
        const std::uint64_t leaves = scene_.bvh.leaves.size();
        const std::uint64_t nodes = scene_.bvh.nodes.size();
        constexpr std::uint64_t kBoxes = 16 * kQuarterVec4s;
        constexpr std::uint64_t kPlanes = 24;
        return sizeof(vec3) * scene_.positions.size() +
               leaves * (4 * kLeafVertices + 4 + 2 * 16 * kLeafVertices + kPlanes + kBoxes) +
               nodes * (sizeof(Node) - 64 + 4 + kPlanes + kBoxes);
    }

    std::span<const vec3> next_positions() {
        is_moved_ = !is_moved_;
        return is_moved_ ? scene_.moved : scene_.positions;
    }

    void refit() {
        const auto ours = [&](std::size_t) {
            ours_->refit(next_positions(), RefitExtent::kAll);
            return ours_->finish().update.refit_ms;
        };
        constexpr const char* kCopy = "copy-of-its-bytes";
        const std::vector<Times> times =
            time(ours, kCopy, [&](std::size_t) { return peer_.copy(refit_bytes() / 2); });
        report("refit", kCopy, times, Unit::kNs, scene_.topology().triangles.size(), 0);
    }

    static constexpr const char* kPeer = "bvh2";
    const BenchScene& scene_;
    int repeat_;
    Report& report_;
    PeerTree tree_;
    std::vector<Ray> diffuse_;
    std::shared_ptr<gpu::SharedDevice> shared_;
    std::unique_ptr<Backend> ours_;
    PeerTracer peer_;
    bool is_moved_ = false;
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
}  // namespace mray::bench

int main(int argc, char** argv) {
    using namespace mray::bench;
    return bench_main("morphray_gpu_bench", BenchProgram::kRun, argc, argv, run);
}
