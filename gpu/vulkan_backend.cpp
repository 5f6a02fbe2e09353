#include "gpu/vulkan_backend.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <chrono>
#include <optional>
#include <utility>

#include "common/base/errors.h"
#include "common/update/refit_plan.h"
#include "common/update/tree_cost.h"
#include "gpu/image_tracer.h"
#include "gpu/kernels.h"
#include "gpu/ray_passes.h"
#include "gpu/refit_pass.h"
#include "gpu/vulkan/limits.h"
#include "gpu/vulkan_backend_internal.h"

namespace morphray::gpu {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

std::uint32_t groups_of(std::uint32_t items) { return (items + kGroupSize - 1) / kGroupSize; }

/// What restructured trees have to spare on the device: they grow, mostly once by a third and then
/// by less and less.
constexpr double kRoom = 0.5;

class VulkanBackend final : public Backend {
public:
    VulkanBackend(const VulkanConfig& config, const Tuning& tuning)
        : context_(config, tuning),
          transfer_(context_),
          kernels_(context_, tuning),
          passes_(context_, pass_size(context_.limits(), tuning), tuning.step_budget),
          scene_(context_, transfer_, Topology{}, {}, empty_tree()),
          images_(context_, transfer_, kernels_, passes_, scene_),
          force_interpolation_(tuning.force_interpolation) {
        assert(tuning.step_budget >= 1 && tuning.step_budget <= kStepBudget);
        scene_.make_keyframes(context_);
        bind();
        warm_up();
    }

    ~VulkanBackend() override { context_.abandon(); }

    const std::string& name() const override { return name_; }
    std::string description() const override;
    void set_scene(const Topology& topology, std::span<const vec3> positions,
                   const Bvh& bvh) override;
    void set_frame(std::span<const vec3> positions, const Bvh& bvh) override;
    std::uint64_t refit(std::span<const vec3> positions, RefitExtent extent) override;
    bool interpolates() const override { return interpolates_; }
    std::uint64_t refit_to(Pose& pose, RefitExtent extent) override;
    double tree_cost() override;
    std::size_t restructure(const Topology& topology, double growth, BuiltAreas& areas) override;
    void read_bvh(Bvh& bvh) override;
    void trace_image(const ImageParams& params, Frame& frame) override;
    void begin_image(const ImageParams& params, Frame& frame) override;
    void finish() override;
    void trace_rays(std::span<const Ray> rays, std::span<Hit> hits) override;
    const BackendTimes& times() override;

private:
    void bind();
    void warm_up();
    void keep_links(const Bvh& bvh);
    std::optional<std::uint64_t> change_tree(const Bvh& before, const Bvh& after);
    void clear();
    void finish_image();
    bool has_keyframes(const KeyframePose& pose);
    void load_keyframes(const KeyframePose& pose);
    template <class Make>
    void refit_later(Make make);
    void take_positions();
    void catch_up();

    const std::string name_ = "vulkan";
    Context context_;
    Transfer transfer_;
    Kernels kernels_;
    RayPasses passes_;
    SceneBuffers scene_;
    ImageTracer images_;
    RefitPlanner planner_;
    /// The pose, where it is not planner_.pose().
    std::optional<KeyframePose> keyframe_pose_;
    /// Whether the device's tree is not, or not yet, that of the pose.
    bool is_behind_ = false;
    /// Whether keyframes are interpolated on the device where there is room for them, and whether
    /// there is.
    bool force_interpolation_;
    bool interpolates_ = false;
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
            if (kernels_.packet_lanes >= 8) dispatch(kernels_.tall_shadow_packet, nothing);
            dispatch(kernels_.occlusion_packet, OcclusionArguments{});
        }
        dispatch(kernels_.occlusion, OcclusionArguments{});
        dispatch(kernels_.rays, RaysArguments{});
        dispatch(kernels_.resume, ResumeArguments{});
        dispatch(kernels_.deform, DeformArguments{});
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
    finish_image();
    const auto start = Clock::now();
    const SceneSize size = size_of(positions.size(), topology.triangles.size(), bvh);
    check_scene(context_.physical(), size);
    // The old scene goes first, with what was to become of it: there may not be room for both.
    context_.drop_deferred();
    is_behind_ = interpolates_ = false;
    keyframe_pose_.reset();
    clear();
    scene_ = SceneBuffers(context_, transfer_, topology, positions, bvh);
    bind();
    // Where positions are written in place, interpolating them is the dearer way.
    interpolates_ = (force_interpolation_ || !scene_.positions_are_mapped()) &&
                    fits_keyframes(context_.physical(), size);
    planner_ = RefitPlanner(positions);
    keep_links(bvh);
    context_.throw_on_validation_errors();
    times_ = {};
    times_.tree_bytes = scene_.tree_bytes();
    times_.upload_ms = ms_since(start);
}

void VulkanBackend::set_frame(std::span<const vec3> positions, const Bvh& bvh) {
    finish();
    const auto start = Clock::now();
    check_scene(context_.physical(), size_of(positions.size(), scene_.triangle_count(), bvh));
    is_behind_ = true;
    scene_.set_positions(transfer_, positions);
    scene_.set_tree(context_, transfer_, bvh);
    bind();
    planner_.set_frame(positions);
    keyframe_pose_.reset();
    is_behind_ = false;
    keep_links(bvh);
    context_.throw_on_validation_errors();
    times_.tree_bytes = scene_.tree_bytes();
    times_.upload_ms = ms_since(start);
}

std::uint64_t VulkanBackend::refit(std::span<const vec3> positions, RefitExtent extent) {
    // One can wait for a submission, and one be under way.
    if (context_.has_deferred() || !context_.is_under_way()) finish();
    const auto start = Clock::now();
    planner_.advance(positions);
    // What moved is known of poses that the host has seen.
    if (std::exchange(keyframe_pose_, std::nullopt)) extent = RefitExtent::kAll;
    const RefitPlan plan = planner_.plan(links_, extent);
    times_.refit_ms = 0;
    times_.refitted_leaves = plan.leaf_count;
    refit_later([&] { return refit_scene(context_, kernels_, scene_, planner_.pose(), plan); });
    times_.upload_ms = ms_since(start);
    return plan.leaf_count;
}

std::uint64_t VulkanBackend::refit_to(Pose& pose, RefitExtent extent) {
    const std::optional<KeyframePose> next = interpolates_ ? pose.keyframes() : std::nullopt;
    const bool are_there = next && has_keyframes(*next);
    // A keyframe that would go up for itself alone goes up as a pose.
    if (!next || (!are_there && next->blend.before == next->blend.after)) {
        return refit(pose.positions(), extent);
    }
    // As refit(); and what is under way may read the keyframes that have to go.
    if (!are_there || context_.has_deferred() || !context_.is_under_way()) finish();
    const auto start = Clock::now();
    times_.refit_ms = times_.upload_ms = 0;
    times_.refitted_leaves = 0;
    if (keyframe_pose_ == next && extent == RefitExtent::kMoved) return 0;
    if (!are_there) load_keyframes(*next);
    keyframe_pose_ = next;
    times_.refitted_leaves = scene_.leaf_count();
    refit_later([&] { return refit_scene(context_, kernels_, scene_, *next); });
    times_.upload_ms = ms_since(start);
    return scene_.leaf_count();
}

bool VulkanBackend::has_keyframes(const KeyframePose& pose) {
    const KeyframeSlots* slots = scene_.keyframes();
    return slots != nullptr && slots->holds(*pose.keyframes, pose.blend.before) &&
           slots->holds(*pose.keyframes, pose.blend.after);
}

void VulkanBackend::load_keyframes(const KeyframePose& pose) {
    if (scene_.keyframes() == nullptr) {
        scene_.make_keyframes(context_);
        bind();
    }
    scene_.keyframes()->load(transfer_, pose);
}

/// Of a pose that has been taken; `make` gives what brings the tree to it.
template <class Make>
void VulkanBackend::refit_later(Make make) {
    const bool was_behind = std::exchange(is_behind_, true);
    Record record = make();
    if (!record) {
        is_behind_ = was_behind;
        return;
    }
    context_.defer(std::move(record), [this](double device_ms) {
        times_.refit_ms = device_ms;
        is_behind_ = context_.has_deferred();
    });
}

/// Has the host know the pose's positions.
void VulkanBackend::take_positions() {
    if (!keyframe_pose_) return;
    std::vector<vec3> positions(scene_.vertex_count());
    keyframe_pose_->keyframes->positions(keyframe_pose_->blend, positions);
    planner_.advance(positions);
    keyframe_pose_.reset();
}

double VulkanBackend::tree_cost() {
    finish();
    return morphray::tree_cost(scene_.read_nodes(transfer_));
}

std::size_t VulkanBackend::restructure(const Topology& topology, double growth, BuiltAreas& areas) {
    Bvh before;
    read_bvh(before);
    Bvh tree = before;
    take_positions();
    const std::size_t parts =
        morphray::restructure(topology, planner_.pose().positions(), growth, tree, areas);
    times_.tree_bytes = 0;
    if (parts == 0) return 0;
    check_scene(context_.physical(), size_of(scene_.vertex_count(), scene_.triangle_count(), tree));
    if (const auto written = change_tree(before, tree)) {
        times_.tree_bytes = *written;
    } else {
        SceneSize roomy = size_of(scene_.vertex_count(), scene_.triangle_count(), tree);
        roomy.nodes += roomy.nodes / 2;
        roomy.leaves += roomy.leaves / 2;
        scene_.set_tree(context_, transfer_, tree, fits(context_.physical(), roomy) ? kRoom : 0);
        bind();
        times_.tree_bytes = scene_.tree_bytes();
    }
    planner_.set_tree();
    keep_links(tree);
    return parts;
}

std::optional<std::uint64_t> VulkanBackend::change_tree(const Bvh& before, const Bvh& after) {
    try {
        return scene_.change_tree(transfer_, before, after);
    } catch (const Error&) {
        // Half of a tree is worse than none.
        clear();
        throw;
    }
}

void VulkanBackend::clear() {
    const Bvh nothing = empty_tree();
    scene_ = SceneBuffers(context_, transfer_, Topology{}, {}, nothing);
    keep_links(nothing);
    bind();
}

void VulkanBackend::read_bvh(Bvh& bvh) {
    finish();
    bvh = links_;
    bvh.nodes.resize(links_.node_parents.size());
    bvh.leaves.resize(links_.leaf_parents.size());
    scene_.read_tree(transfer_, bvh);
}

void VulkanBackend::trace_image(const ImageParams& params, Frame& frame) {
    begin_image(params, frame);
    finish_image();
}

void VulkanBackend::begin_image(const ImageParams& params, Frame& frame) {
    finish_image();
    catch_up();
    images_.begin(params, frame);
}

void VulkanBackend::finish() {
    finish_image();
    catch_up();
    if (context_.has_deferred())
        context_.submit(
            "refit", [](VkCommandBuffer) {}, Deferred::kTaken);
}

/// Nothing is under way: after an error the tree may be that of an older pose.
void VulkanBackend::catch_up() {
    if (!is_behind_ || context_.has_deferred()) return;
    take_positions();
    const RefitPlan all = planner_.plan(links_, RefitExtent::kAll);
    refit_later([&] { return refit_scene(context_, kernels_, scene_, planner_.pose(), all); });
}

void VulkanBackend::finish_image() {
    if (images_.is_under_way()) images_.end(times_);
}

const BackendTimes& VulkanBackend::times() {
    finish();
    return times_;
}

void VulkanBackend::trace_rays(std::span<const Ray> rays, std::span<Hit> hits) {
    assert(rays.size() == hits.size());
    finish();
    times_.trace_ms = 0;
    times_.rays = rays.size();
    for (std::size_t first = 0; first < rays.size(); first += passes_.size().rays()) {
        const std::size_t count = std::min<std::size_t>(passes_.size().rays(), rays.size() - first);
        transfer_.upload(std::as_bytes(rays.subspan(first, count)), passes_.rays());
        const RaysArguments arguments = {.ray_count = static_cast<std::uint32_t>(count)};
        const Record dispatch = [&](VkCommandBuffer commands) {
            kernels_.rays.dispatch(commands, arguments, groups_of(arguments.ray_count));
        };
        times_.trace_ms += passes_.run({"trace rays", false, dispatch, {}}, kernels_, scene_);
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
