#include "gpu/vulkan_backend.h"

#include <fmt/format.h>

#include <cassert>

#include "common/update/refit_plan.h"
#include "gpu/image_tracer.h"
#include "gpu/kernels.h"
#include "gpu/limits.h"
#include "gpu/lit_tracer.h"
#include "gpu/queries.h"
#include "gpu/ray_passes.h"
#include "gpu/shared_device.h"

namespace mray::gpu {
namespace {

SceneSize size_of(std::uint64_t vertices, std::uint64_t triangles, const Bvh& bvh) {
    return {vertices,          triangles,   bvh.nodes.size(),
            bvh.leaves.size(), bvh.depth(), bvh.repeated.size()};
}

BackendInfo info_of(const DeviceInfo& device) {
    return {.name = "vulkan",
            .description =
                fmt::format("{}, {}, Vulkan {}.{}{}", device.name, device.driver, device.api_major,
                            device.api_minor,
                            device.promises_floats ? "" : ", rounding tested and not promised"),
            .is_on_processor = device.type == "cpu",
            .call_size = std::size_t{1} << 16,
            .trace_per_visit = 0.002};
}

class VulkanBackend final : public Backend {
public:
    VulkanBackend(std::shared_ptr<SharedDevice> device, const Tuning& tuning)
        : Backend(info_of(device->device.physical().info)),
          shared_(std::move(device)),
          tuning_(tuning),
          context_(shared_->device, tuning.submit_timeout_ms),
          transfer_(context_),
          kernels_(*shared_, context_, step_budget(physical(), tuning)),
          passes_(*shared_, context_, kernels_, scene_, pass_size(physical(), tuning)),
          scene_(shared_->device, choose_buffers(physical(), tuning, {}), transfer_, Topology{}, {},
                 empty_tree()),
          images_(context_, kernels_, passes_),
          lit_images_(context_, kernels_, passes_, images_) {
        bind();
        // A device that is lost or does not answer fails here instead of at the first image.
        context_.submit("start", [](VkCommandBuffer) {});
    }

    void require_own_process() const override { throw_if_forked(); }

    void set_scene(const Topology& topology, const Pose& pose, Bvh bvh) override {
        const Stopwatch watch;
        const BufferKind kind = choose_buffers(
            physical(), tuning_, size_of(topology.vertex_count, topology.triangles.size(), bvh));
        // The scene before goes first: there may not be room for both.
        clear();
        SceneBuffers next(shared_->device, kind, transfer_, topology, pose.positions(), bvh);
        no_scene_.emplace(std::move(scene_));
        scene_ = std::move(next);
        bind();
        topology_ = &topology;
        pose_ = &pose;
        keep_links(bvh);
        shared_->device.throw_on_validation_errors();
        times_ = {.update = {.upload_ms = watch.ms()}};
    }

    void set_tree(Bvh bvh) override {
        require_scene();
        finish_refit();
        const Stopwatch watch;
        is_behind_ = true;
        if (!holds(bvh)) return set_scene(*topology_, *pose_, std::move(bvh));
        scene_.set_positions(transfer_, pose_->positions());
        take_tree(bvh);
        is_behind_ = false;
        shared_->device.throw_on_validation_errors();
        times_.update.upload_ms = watch.ms();
    }

    std::uint64_t refit(RefitExtent extent) override {
        require_scene();
        finish_refit();
        // A call that fails must not lose the blocks that moved.
        is_behind_ = true;
        const Stopwatch rest_watch;
        const PositionUpdate positions =
            extent == RefitExtent::kAll ? all_positions(*pose_) : moved_positions(context_, *pose_);
        if (scene_.set_rest_positions(transfer_, positions.bodies)) bind();
        const double rest_ms = rest_watch.ms();
        kernels_.prepare({&kernels_.refit_leaves, &kernels_.refit_nodes});
        if (!positions.bodies.empty()) kernels_.prepare({&kernels_.move_bodies});
        const Stopwatch watch;
        const RefitPlan plan = plan_refit(links_, *pose_, extent, block_leaves_);
        host_tree_.reset();
        times_.update.refit_ms = 0;
        defer_refit(positions, lacks_boxes_ ? plan_all() : plan);
        times_.update.upload_ms = rest_ms + watch.ms();
        return plan.leaf_count;
    }

    std::span<const Node> nodes() override {
        finish_refit();
        return scene_.nodes(transfer_, nodes_);
    }

    const Bvh& host_tree() override {
        if (!host_tree_) {
            Bvh tree;
            read_tree(tree);
            host_tree_ = std::move(tree);
        }
        return *host_tree_;
    }

    void read_tree(Bvh& bvh) override {
        finish_refit();
        bvh = links_;
        bvh.nodes.resize(links_.node_parents.size());
        bvh.leaves.resize(links_.leaf_parents.size());
        scene_.read_tree(transfer_, bvh);
    }

    void edit_tree(const TreeEdit& edit) override {
        Bvh tree;
        read_tree(tree);
        if (!edit(tree)) return;
        if (!holds(tree)) return set_scene(*topology_, *pose_, std::move(tree));
        take_tree(tree);
    }

    void trace_image(const ImageParams& params, Frame& frame) override {
        prepare_rays();
        const RayPasses::Use use = use_ray_buffers();
        images_.trace(params, frame, times_, image_watch());
    }

    bool trace_lit(const LitView& view, Frame& samples, std::span<std::uint32_t> pixels,
                   std::span<LinearColour> linear) override {
        if (!lit_images_.has_room()) return false;
        if (view.normals != nullptr) {
            if (!scene_.holds(*view.normals)) return false;
            if (scene_.set_normals(transfer_, *view.normals)) bind();
        }
        prepare_rays();
        const RayPasses::Use use = use_ray_buffers();
        lit_images_.trace(view, samples, pixels, linear, times_, image_watch());
        return true;
    }

    void trace_views(const ViewBatch& views) override {
        prepare_rays();
        const RayPasses::Use use = use_ray_buffers();
        images_.trace_views(views, times_, image_watch());
    }

    /// Any hits are closest hits: no kernel ends at the first hit of any ray.
    double trace(const RayBatch& batch) override {
        const std::span<const Ray> rays = batch.rays;
        std::vector<Hit> found(batch.occluded.size());
        const std::span<Hit> hits = batch.occluded.empty() ? batch.hits : std::span(found);
        assert(rays.size() == hits.size());
        prepare_rays();
        finish_refit();
        const RayPasses::Use use = use_ray_buffers();
        kernels_.prepare({&kernels_.rays, &kernels_.decide});
        times_.trace_ms = 0;
        times_.rays = rays.size();
        for (std::size_t first = 0; first < rays.size(); first += passes_.size().rays()) {
            const std::size_t count =
                std::min<std::size_t>(passes_.size().rays(), rays.size() - first);
            transfer_.upload(std::as_bytes(rays.subspan(first, count)),
                             passes_.buffers()->rays.buffer);
            const CountArguments arguments = {static_cast<std::uint32_t>(count)};
            times_.trace_ms +=
                passes_.run("trace rays", false, arguments.count, [&](VkCommandBuffer commands) {
                    kernels_.rays.dispatch(commands, arguments, groups_of(arguments.count));
                });
            transfer_.download(passes_.buffers()->hits.buffer,
                               std::as_writable_bytes(hits.subspan(first, count)));
        }
        for (std::size_t i = 0; i < found.size(); ++i)
            batch.occluded[i] = found[i].prim_id != kNoPrim ? 1 : 0;
        return times_.trace_ms;
    }

    void query(const QueryBatch& batch) override {
        finish_refit();
        const RayPasses::Use use = use_ray_buffers();
        answer(batch, transfer_, kernels_, passes_, scene_);
    }

    const BackendTimes& finish() override {
        finish_refit();
        return times_;
    }

private:
    const PhysicalDevice& physical() const { return shared_->device.physical(); }

    /// False if the scene with this tree needs another kind of buffers. Throws Error(kLimit) if no
    /// kind holds it.
    bool holds(const Bvh& bvh) const {
        return scene_.kind() ==
               choose_buffers(physical(), tuning_,
                              size_of(scene_.vertex_count(), scene_.triangle_count(), bvh));
    }

    void bind() {
        Bindings bindings;
        scene_.add_to(bindings);
        bound_ = passes_.buffers();
        if (bound_ != nullptr) bound_->add_to(bindings);
        kernels_.set_bindings(scene_.kind(), bindings);
    }

    RayPasses::Use use_ray_buffers() {
        RayPasses::Use use = passes_.use();
        if (bound_ != passes_.buffers()) bind();
        return use;
    }

    void take_tree(const Bvh& bvh) {
        scene_.set_tree(transfer_, bvh);
        bind();
        keep_links(bvh);
    }

    /// Notes that the device has another tree.
    void keep_links(const Bvh& bvh) {
        host_tree_.reset();
        block_leaves_.reset();
        lacks_boxes_ = true;
        links_.leaf_vertices = bvh.leaf_vertices;
        links_.leaf_parents = bvh.leaf_parents;
        links_.node_parents = bvh.node_parents;
        links_.level_begin = bvh.level_begin;
        links_.repeated = bvh.repeated;
        links_.triangle_count = bvh.triangle_count;
    }

    void require_scene() const {
        if (pose_ == nullptr)
            throw Error(ErrorKind::kBadArgument,
                        "no scene is set; a call that failed may have dropped it");
    }

    /// Drops scene and deferred refit: nothing is hit. Makes nothing: memory may be used up.
    void clear() {
        context_.drop_deferred();
        is_behind_ = false;
        pose_ = nullptr;
        keep_links(empty_tree());
        lacks_boxes_ = false;
        if (!no_scene_) return;
        scene_ = std::move(*no_scene_);
        no_scene_.reset();
        bind();
    }

    RefitPlan plan_all() const { return {.all = true, .leaf_count = links_.leaf_parents.size()}; }

    /// Leaves a refit to the pose to the next submission.
    void defer_refit(const PositionUpdate& positions, const RefitPlan& plan) {
        Record record = refit_scene(context_, kernels_, scene_, positions, *pose_, plan);
        is_behind_ = static_cast<bool>(record);
        if (!is_behind_) return;
        context_.defer(std::move(record), [this, is_all = plan.all](double device_ms) {
            times_.update.refit_ms = device_ms;
            is_behind_ = false;
            if (is_all) lacks_boxes_ = false;
        });
    }

    /// Defers a refit of everything if a failed call has left the tree at an older pose.
    void catch_up() {
        if (!is_behind_ || context_.has_deferred()) return;
        kernels_.prepare({&kernels_.refit_leaves, &kernels_.refit_nodes});
        defer_refit(all_positions(*pose_), plan_all());
    }

    /// catch_up(), and for a tree that was set: a refit writes the boxes that rays need.
    void prepare_rays() {
        is_behind_ = is_behind_ || (lacks_boxes_ && !links_.leaf_parents.empty());
        catch_up();
    }

    void finish_refit() {
        catch_up();
        if (context_.has_deferred()) context_.submit("refit", [](VkCommandBuffer) {});
    }

    std::shared_ptr<SharedDevice> shared_;
    Tuning tuning_;
    Context context_;
    Transfer transfer_;
    Kernels kernels_;
    RayPasses passes_;
    const RayBuffers* bound_ = nullptr;
    SceneBuffers scene_;
    const Topology* topology_ = nullptr;
    /// The scene of nothing while scene_ is another, so that dropping that one cannot fail.
    std::optional<SceneBuffers> no_scene_;
    ImageTracer images_;
    LitTracer lit_images_;
    /// Null without a scene.
    const Pose* pose_ = nullptr;
    /// True while the device's tree is of an older pose.
    bool is_behind_ = false;
    /// Whether boxes of quarters and groups, which rays need, are not those of the tree.
    bool lacks_boxes_ = false;
    /// The tree without its nodes and leaves, which are on the device.
    Bvh links_;
    std::optional<BlockLeaves> block_leaves_;
    /// host_tree(), where it has been read since positions or tree changed.
    std::optional<Bvh> host_tree_;
    /// The nodes for nodes(), if the host does not see the device's.
    AlignedVector<Node> nodes_;
    BackendTimes times_;
};

}  // namespace

std::unique_ptr<Backend> make_backend_on(std::shared_ptr<SharedDevice> device,
                                         const Tuning& tuning) {
    throw_if_forked();
    return std::make_unique<VulkanBackend>(std::move(device), tuning);
}

std::unique_ptr<Backend> make_vulkan_backend(const VulkanConfig& config, const Tuning& tuning) {
    return make_backend_on(open_device(config, tuning), tuning);
}

}  // namespace mray::gpu
