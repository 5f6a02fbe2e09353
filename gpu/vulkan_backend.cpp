#include "gpu/vulkan_backend.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cstring>

#include "common/refit_plan.h"
#include "common/tree_cost.h"
#include "gpu/camera_packets.h"
#include "gpu/kernels.h"
#include "gpu/limits.h"
#include "gpu/ray_passes.h"
#include "gpu/refit_pass.h"
#include "gpu/vulkan_backend_internal.h"

namespace morphray::gpu {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

std::uint32_t groups_of(std::uint32_t items) { return (items + kGroupSize - 1) / kGroupSize; }

Bvh empty_tree() {
    Bvh bvh;
    Node& root = bvh.nodes.emplace_back();
    for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
        root.lower_x[slot] = root.lower_y[slot] = root.lower_z[slot] = kEmptyPlane;
        root.upper_x[slot] = root.upper_y[slot] = root.upper_z[slot] = -kEmptyPlane;
        root.child[slot] = kEmptyChild;
    }
    bvh.node_parents = {kNoParent};
    bvh.level_begin = {0, 1};
    return bvh;
}

std::uint32_t rays_per_hit(const ImageParams& params) {
    if (params.rays == kRaysShadow) return 1;
    return params.rays == kRaysAo ? params.ao_count : 0;
}

std::uint64_t count_rays(const ImageParams& params, const Frame& frame) {
    const auto hits = static_cast<std::uint64_t>(
        std::count_if(frame.hits.begin(), frame.hits.end(),
                      [](const Hit& hit) { return hit.prim_id != kNoPrim; }));
    return frame.hits.size() + hits * rays_per_hit(params);
}

class VulkanBackend final : public Backend {
public:
    VulkanBackend(const VulkanConfig& config, const Tuning& tuning)
        : context_(config, tuning),
          transfer_(context_),
          kernels_(context_, tuning),
          passes_(context_, pass_size(context_.limits(), tuning), tuning.step_budget),
          scene_(context_, transfer_, Topology{}, {}, empty_tree()) {
        assert(tuning.step_budget >= 1 && tuning.step_budget <= kStepBudget);
        bind();
        warm_up();
    }

    const std::string& name() const override { return name_; }
    std::string description() const override;
    void set_scene(const Topology& topology, std::span<const vec3> positions,
                   const Bvh& bvh) override;
    void set_frame(std::span<const vec3> positions, const Bvh& bvh) override;
    void refit(std::span<const vec3> positions, RefitExtent extent) override;
    double tree_cost() override;
    std::size_t restructure(const Topology& topology, double growth, BuiltAreas& areas) override;
    void read_bvh(Bvh& bvh) override;
    void trace_image(const ImageParams& params, Frame& frame) override;
    void trace_rays(std::span<const Ray> rays, std::span<Hit> hits) override;
    const BackendTimes& times() const override { return times_; }

private:
    void bind();
    void warm_up();
    void keep_links(const Bvh& bvh);
    std::function<void(VkCommandBuffer)> camera_packets(const RegionArguments& region) const;
    void trace_region(const RegionArguments& region);
    std::uint32_t packet_groups(std::uint32_t packets) const;
    void trace_shadow_packets(const RegionArguments& region);
    void trace_secondary(const RegionArguments& region);
    void copy_region(const RegionArguments& region, Frame& frame);

    const std::string name_ = "vulkan";
    Context context_;
    Transfer transfer_;
    Kernels kernels_;
    RayPasses passes_;
    SceneBuffers scene_;
    RefitPlanner planner_;
    /// The tree without its nodes and leaves, which are on the device.
    Bvh links_;
    BackendTimes times_;
};

SceneSize size_of(std::uint64_t vertices, std::uint64_t triangles, const Bvh& bvh) {
    return {vertices, triangles, bvh.nodes.size(), bvh.leaves.size(), bvh.depth()};
}

std::string VulkanBackend::description() const {
    const DeviceInfo& info = context_.physical().info;
    return fmt::format("{}, {}, Vulkan {}.{}", info.name, info.driver, info.api_major,
                       info.api_minor);
}

void VulkanBackend::bind() {
    Bindings bindings;
    scene_.add_to(bindings);
    passes_.add_to(bindings);
    kernels_.bind(bindings);
}

/// Some drivers compile a kernel when it is first dispatched (13 to 89 ms each on lavapipe), so
/// each is dispatched here over nothing.
void VulkanBackend::warm_up() {
    context_.submit("warm up", [&](VkCommandBuffer commands) {
        const auto dispatch = [&](const Pipeline& pipeline, const auto& arguments) {
            pipeline.dispatch(commands, arguments, 1);
            // Writer and reader: as far as anyone can tell, each kernel writes what the next reads.
            barrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT,
                    VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                    VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT);
        };
        RegionArguments nothing = {};
        nothing.tile_columns = 1;
        nothing.tile_count = 1;
        for (const Pipeline* p : {&kernels_.primary, &kernels_.select, &kernels_.shade}) {
            dispatch(*p, nothing);
        }
        if (kernels_.packet_lanes != 0) {
            dispatch(kernels_.primary_packet, PacketArguments{});
            dispatch(kernels_.shadow_packet, nothing);
        }
        dispatch(kernels_.occlusion, OcclusionArguments{});
        dispatch(kernels_.rays, RaysArguments{});
        dispatch(kernels_.resume, ResumeArguments{});
        dispatch(kernels_.refit_leaves, RefitArguments{});
        dispatch(kernels_.refit_nodes, RefitArguments{});
    });
}

void VulkanBackend::keep_links(const Bvh& bvh) {
    links_.leaf_vertices = bvh.leaf_vertices;
    links_.leaf_parents = bvh.leaf_parents;
    links_.node_parents = bvh.node_parents;
    links_.level_begin = bvh.level_begin;
    links_.triangle_count = bvh.triangle_count;
}

void VulkanBackend::set_scene(const Topology& topology, std::span<const vec3> positions,
                              const Bvh& bvh) {
    const auto start = Clock::now();
    check_scene(context_.physical(), size_of(positions.size(), topology.triangles.size(), bvh));
    // The old scene goes first: there may not be room for both.
    scene_ = SceneBuffers(context_, transfer_, Topology{}, {}, empty_tree());
    bind();
    scene_ = SceneBuffers(context_, transfer_, topology, positions, bvh);
    bind();
    planner_ = RefitPlanner(positions);
    keep_links(bvh);
    context_.throw_on_validation_errors();
    times_ = {};
    times_.upload_ms = ms_since(start);
}

void VulkanBackend::set_frame(std::span<const vec3> positions, const Bvh& bvh) {
    const auto start = Clock::now();
    check_scene(context_.physical(), size_of(positions.size(), scene_.triangle_count(), bvh));
    scene_.set_positions(transfer_, positions);
    scene_.set_tree(context_, transfer_, bvh);
    bind();
    planner_.set_frame(positions);
    keep_links(bvh);
    context_.throw_on_validation_errors();
    times_.upload_ms = ms_since(start);
}

void VulkanBackend::refit(std::span<const vec3> positions, RefitExtent extent) {
    const auto start = Clock::now();
    planner_.advance(positions);
    const RefitPlan plan = planner_.plan(links_, extent);
    upload_positions(scene_, transfer_, planner_.pose(), plan);
    times_.upload_ms = ms_since(start);
    times_.refit_ms = refit_scene(context_, kernels_, scene_, plan);
    times_.refitted_leaves = plan.leaf_count;
}

double VulkanBackend::tree_cost() { return morphray::tree_cost(scene_.read_nodes(transfer_)); }

std::size_t VulkanBackend::restructure(const Topology& topology, double growth, BuiltAreas& areas) {
    Bvh tree;
    read_bvh(tree);
    const std::size_t parts =
        morphray::restructure(topology, planner_.pose().positions(), growth, tree, areas);
    if (parts == 0) return 0;
    check_scene(context_.physical(), size_of(scene_.vertex_count(), scene_.triangle_count(), tree));
    scene_.set_tree(context_, transfer_, tree);
    bind();
    planner_.set_tree();
    keep_links(tree);
    return parts;
}

void VulkanBackend::read_bvh(Bvh& bvh) {
    bvh = links_;
    bvh.nodes.resize(links_.node_parents.size());
    bvh.leaves.resize(links_.leaf_parents.size());
    scene_.read_tree(transfer_, bvh);
}

void VulkanBackend::trace_image(const ImageParams& params, Frame& frame) {
    const std::size_t pixel_count = std::size_t{params.width} * params.height;
    frame.width = params.width;
    frame.height = params.height;
    frame.hits.resize(pixel_count);
    frame.occlusion.assign(pixel_count, 0);
    frame.pixels.resize(pixel_count);
    times_.trace_ms = times_.secondary_ms = times_.shade_ms = 0;
    times_.rays = 0;
    // Regions are whole tiles: first as wide as the image or a row of them, then as high.
    const std::uint32_t tiles = passes_.size().tiles;
    const std::uint32_t columns = std::min(tiles, (params.width + kTileSize - 1) / kTileSize);
    if (columns == 0) return;
    const std::uint32_t width = columns * kTileSize;
    const std::uint32_t height = tiles / columns * kTileSize;
    for (std::uint32_t y = 0; y < params.height; y += height) {
        for (std::uint32_t x = 0; x < params.width; x += width) {
            RegionArguments region = {};
            region.params = params;
            region.x = x;
            region.y = y;
            region.width = std::min(width, params.width - x);
            region.height = std::min(height, params.height - y);
            region.tile_columns = (region.width + kTileSize - 1) / kTileSize;
            region.tile_count = region.tile_columns * ((region.height + kTileSize - 1) / kTileSize);
            trace_region(region);
            copy_region(region, frame);
        }
    }
    times_.trace_ms += times_.secondary_ms + times_.shade_ms;
    times_.rays = count_rays(params, frame);
}

std::uint32_t VulkanBackend::packet_groups(std::uint32_t packets) const {
    const std::uint32_t run = packet_run(context_.physical());
    return groups_of((packets + run - 1) / run * kernels_.packet_lanes);
}

std::function<void(VkCommandBuffer)> VulkanBackend::camera_packets(
    const RegionArguments& region) const {
    return [this, arguments = packet_arguments(region)](VkCommandBuffer commands) {
        kernels_.primary_packet.dispatch(commands, arguments, packet_groups(arguments.tile_count));
    };
}

void VulkanBackend::trace_region(const RegionArguments& region) {
    const auto dispatch = [&](const Pipeline& pipeline, const RegionArguments& arguments) {
        return [&pipeline, arguments](VkCommandBuffer commands) {
            pipeline.dispatch(commands, arguments, arguments.tile_count);
        };
    };
    RegionArguments rest = region;
    rest.unfinished_only = 1;
    times_.trace_ms += kernels_.packet_lanes == 0
                           ? passes_.run("trace camera rays", kernels_, scene_, false,
                                         dispatch(kernels_.primary, region))
                           : passes_.run("trace camera rays", kernels_, scene_, false,
                                         camera_packets(region), dispatch(kernels_.primary, rest));
    if (region.params.rays == kRaysShadow && kernels_.packet_lanes != 0) {
        trace_shadow_packets(region);
    } else if (rays_per_hit(region.params) != 0) {
        trace_secondary(region);
    }
    times_.shade_ms += context_.submit("shade", dispatch(kernels_.shade, region));
}

void VulkanBackend::trace_shadow_packets(const RegionArguments& region) {
    RegionArguments arguments = region;
    arguments.tile_columns = (region.width + kPacketWidth - 1) / kPacketWidth;
    arguments.tile_count =
        arguments.tile_columns * ((region.height + kPacketHeight - 1) / kPacketHeight);
    times_.secondary_ms +=
        passes_.run("trace shadow rays", kernels_, scene_, true, [&](VkCommandBuffer commands) {
            vkCmdFillBuffer(commands, passes_.occlusion().get(), 0, VK_WHOLE_SIZE, 0);
            // Writer: the fill; writer after it: the kernel.
            barrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                    VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT);
            kernels_.shadow_packet.dispatch(commands, arguments,
                                            packet_groups(arguments.tile_count));
        });
}

void VulkanBackend::trace_secondary(const RegionArguments& region) {
    OcclusionArguments arguments = {};
    arguments.params = region.params;
    arguments.x = region.x;
    arguments.y = region.y;
    arguments.width = region.width;
    times_.secondary_ms += passes_.select(
        [&](VkCommandBuffer commands) {
            kernels_.select.dispatch(commands, region, region.tile_count);
        },
        arguments.seen_count);
    if (arguments.seen_count == 0) return;
    const std::uint32_t samples = rays_per_hit(region.params);
    for (; arguments.sample_index < samples; ++arguments.sample_index) {
        times_.secondary_ms += passes_.run(
            "trace secondary rays", kernels_, scene_, true, [&](VkCommandBuffer commands) {
                kernels_.occlusion.dispatch(commands, arguments, groups_of(arguments.seen_count));
            });
    }
}

/// The rows of a region, from a buffer of one T a pixel to the image.
template <class T>
void copy_rows(Transfer& transfer, const Buffer& from, const RegionArguments& region,
               std::uint32_t image_width, std::vector<T>& to) {
    const std::size_t count = std::size_t{region.width} * region.height;
    std::vector<T> copy;
    const T* rows = reinterpret_cast<const T*>(from.mapped().data());
    if (from.mapped().empty()) {
        copy.resize(count);
        transfer.download(from, std::as_writable_bytes(std::span(copy)));
        rows = copy.data();
    }
    for (std::uint32_t y = 0; y < region.height; ++y) {
        std::copy_n(rows + std::size_t{y} * region.width, region.width,
                    to.data() + std::size_t{region.y + y} * image_width + region.x);
    }
}

void VulkanBackend::copy_region(const RegionArguments& region, Frame& frame) {
    copy_rows(transfer_, passes_.hits(), region, frame.width, frame.hits);
    copy_rows(transfer_, passes_.pixels(), region, frame.width, frame.pixels);
    if (rays_per_hit(region.params) != 0) {
        copy_rows(transfer_, passes_.occlusion(), region, frame.width, frame.occlusion);
    }
}

void VulkanBackend::trace_rays(std::span<const Ray> rays, std::span<Hit> hits) {
    assert(rays.size() == hits.size());
    times_.trace_ms = 0;
    times_.rays = rays.size();
    for (std::size_t first = 0; first < rays.size(); first += passes_.size().rays()) {
        const std::size_t count = std::min<std::size_t>(passes_.size().rays(), rays.size() - first);
        transfer_.upload(std::as_bytes(rays.subspan(first, count)), passes_.rays());
        const RaysArguments arguments = {.ray_count = static_cast<std::uint32_t>(count)};
        times_.trace_ms +=
            passes_.run("trace rays", kernels_, scene_, false, [&](VkCommandBuffer commands) {
                kernels_.rays.dispatch(commands, arguments, groups_of(arguments.ray_count));
            });
        transfer_.download(passes_.hits(), std::as_writable_bytes(hits.subspan(first, count)));
    }
}

}  // namespace

std::vector<DeviceInfo> list_devices(PFN_vkGetInstanceProcAddr loader) {
    ValidationLog log;
    const Instance instance(false, loader, log);
    std::vector<DeviceInfo> infos;
    for (const PhysicalDevice& d : physical_devices(instance)) infos.push_back(d.info);
    return infos;
}

std::vector<DeviceInfo> list_devices() { return list_devices(nullptr); }

std::unique_ptr<Backend> make_vulkan_backend(const VulkanConfig& config, const Tuning& tuning) {
    return std::make_unique<VulkanBackend>(config, tuning);
}

std::unique_ptr<Backend> make_vulkan_backend(const VulkanConfig& config) {
    return make_vulkan_backend(config, Tuning{});
}

}  // namespace morphray::gpu
