// morphray on a Vulkan device beside the peer on the same device: camera, shadow and diffuse rays,
// by the device's clock. Scenes, --repeat, --size, and --csv are those of lab/bench/run. `differ`
// counts rays that hit another triangle than by the peer's rule.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "common/version.h"
#include "gpu/shared_device.h"
#include "gpu/vulkan/context.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/gpu/peer_interface.h"
#include "lab/bench/options.h"
#include "lab/methods/peer_tree.h"
#include "lab/methods/report.h"
#include "lab/methods/tracers.h"
#include "shaders/kernel_interface.h"

// Generated from peer.comp; it uses std::uint32_t without including it.
#include "lab/bench/gpu/peer_spirv.h"

namespace mray::lab {
namespace {

constexpr std::uint64_t kTimeLimitMs = 60'000;

std::uint64_t pixels_of(const ImageParams& params) {
    return std::uint64_t{params.width} * params.height;
}

/// The nodes as the kernel reads them: one for each pair of children, which follow the root.
std::vector<vec4> kernel_nodes(const PeerTree& tree) {
    const auto reference = [](const PeerNode& node) {
        const std::uint32_t child =
            node.count > 0 ? ~(8 * node.first + node.count) : (node.first - 1) / 2;
        return std::bit_cast<float>(child);
    };
    std::vector<vec4> made;
    for (std::size_t i = 1; i + 1 < tree.nodes.size(); i += 2) {
        const PeerNode& a = tree.nodes[i];
        const PeerNode& b = tree.nodes[i + 1];
        made.emplace_back(a.lower.x, a.upper.x, a.lower.y, a.upper.y);
        made.emplace_back(b.lower.x, b.upper.x, b.lower.y, b.upper.y);
        made.emplace_back(a.lower.z, a.upper.z, b.lower.z, b.upper.z);
        made.emplace_back(reference(a), reference(b), 0.0f, 0.0f);
    }
    return made;
}

std::vector<vec4> kernel_triangles(const PeerTree& tree) {
    std::vector<vec4> made;
    for (const PeerTriangle& triangle : tree.triangles) {
        made.emplace_back(triangle.a, std::bit_cast<float>(triangle.prim_id));
        made.emplace_back(triangle.b, 0.0f);
        made.emplace_back(triangle.c, 0.0f);
    }
    return made;
}

/// The kernel that wins on GPUs, over a binary tree by binned SAH.
class PeerTracer {
public:
    /// The tree has more than one leaf, of at most 7 triangles. `rays` are those of kPeerRays.
    PeerTracer(std::shared_ptr<gpu::SharedDevice> device, const PeerTree& tree,
               const ImageParams& params, std::span<const Ray> rays)
        : shared_(std::move(device)),
          tree_(tree),
          params_(params),
          ray_count_(static_cast<std::uint32_t>(rays.size())),
          context_(shared_->device, kTimeLimitMs),
          transfer_(context_) {
        const std::vector<vec4> nodes = kernel_nodes(tree);
        const std::vector<vec4> triangles = kernel_triangles(tree);
        nodes_ = make_buffer("peer's nodes", std::as_bytes(std::span(nodes)));
        triangles_ = make_buffer("peer's triangles", std::as_bytes(std::span(triangles)));
        rays_ = make_buffer("peer's rays", std::as_bytes(rays));
        const std::uint64_t hits = std::max<std::uint64_t>(pixels_of(params), rays.size());
        hits_ = make_buffer("peer's hits", sizeof(Hit) * hits);
        occluded_ = make_buffer("peer's occlusion", 4 * pixels_of(params));
        gpu::Bindings bindings;
        bindings.buffers[kBindNodes] = nodes_.get();
        bindings.buffers[kBindLeaves] = triangles_.get();
        bindings.buffers[kBindRays] = rays_.get();
        bindings.buffers[kBindHits] = hits_.get();
        bindings.buffers[kBindOcclusion] = occluded_.get();
        for (const std::uint32_t mode : {kPeerCamera, kPeerShadow, kPeerRays}) {
            gpu::BoundPipeline& bound = pipelines_.emplace_back(
                shared_->device, shared_->pipelines.get(shared_->device, k_peer_spirv, {mode}));
            bound.bind(bindings);
        }
    }

    /// Traces a mode's rays, those of kPeerShadow from the last kPeerCamera. Returns device ms.
    double trace(std::uint32_t mode) {
        PeerArguments arguments = {};
        arguments.params = params_;
        // The size of the kernels' tiles, not of those of the benchmark.
        constexpr std::uint32_t kSide = mray::kTileSize;
        arguments.tile_columns = (params_.width + kSide - 1) / kSide;
        arguments.ray_count = ray_count_;
        std::uint32_t groups = arguments.tile_columns * ((params_.height + kSide - 1) / kSide);
        if (mode == kPeerRays) groups = (ray_count_ + kGroupSize - 1) / kGroupSize;
        return context_.submit("trace the peer's rays", [&](VkCommandBuffer commands) {
            pipelines_[mode].dispatch(commands, arguments, groups);
        });
    }

    /// The hits of kPeerCamera or kPeerRays, with the prim_ids of the scene.
    std::vector<Hit> hits(std::size_t count) {
        std::vector<Hit> hits(count);
        transfer_.download(hits_, std::as_writable_bytes(std::span(hits)));
        for (Hit& hit : hits)
            if (hit.prim_id != kNoPrim) hit.prim_id = tree_.triangles[hit.prim_id].prim_id;
        return hits;
    }

private:
    gpu::Buffer make_buffer(const char* name, std::uint64_t size) {
        return gpu::Buffer(shared_->device, name, size, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                           gpu::Memory::kDevice);
    }
    gpu::Buffer make_buffer(const char* name, std::span<const std::byte> bytes) {
        gpu::Buffer buffer = make_buffer(name, bytes.size());
        transfer_.upload(bytes, buffer);
        return buffer;
    }

    std::shared_ptr<gpu::SharedDevice> shared_;
    const PeerTree& tree_;
    ImageParams params_;
    std::uint32_t ray_count_;
    gpu::Context context_;
    gpu::Transfer transfer_;
    gpu::Buffer nodes_, triangles_, rays_, hits_, occluded_;
    std::vector<gpu::BoundPipeline> pipelines_;
};

class VulkanBench {
public:
    VulkanBench(const BenchScene& scene, int repeat, Report& report)
        : scene_(scene),
          repeat_(repeat),
          report_(report),
          tree_(build_peer_tree(scene.topology(), scene.positions, 1.5, 4)),
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
    }

private:
    std::vector<Ray> diffuse_rays() const {
        const RaySet set = SceneRays(scene_).rays(RayKind::kDiffuse);
        std::vector<Ray> rays;
        for (std::size_t i = 0; i < set.rays.size(); ++i)
            if (set.active[i] != 0) rays.push_back(set.rays[i]);
        return rays;
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
        compare(work, ray_count, ours, mode, [&] {
            return is_primary ? count_other_triangles(checked.hits, peer_.hits(checked.hits.size()))
                              : 0;
        });
    }

    void trace_diffuse() {
        std::vector<Hit> hits(diffuse_.size());
        const auto ours = [&] {
            ours_->trace({diffuse_, hits});
            return ours_->finish().trace_ms;
        };
        compare("diffuse", hits.size(), ours, kPeerRays,
                [&] { return count_other_triangles(hits, peer_.hits(hits.size())); });
    }

    const BenchScene& scene_;
    int repeat_;
    Report& report_;
    PeerTree tree_;
    std::vector<Ray> diffuse_;
    std::shared_ptr<gpu::SharedDevice> shared_;
    std::unique_ptr<Backend> ours_;
    PeerTracer peer_;
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
