#include "library/src/scene_impl.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "common/base/stopwatch.h"
#include "common/ray_queries.h"
#include "library/src/policy.h"
#include "library/src/queries/device_queries.h"
#include "library/src/queries/host_queries.h"
#include "library/src/scene/errors.h"

namespace morphray::detail {
namespace {

void check(const std::optional<Box>& bounds) {
    if (!bounds) return;
    // Positions are floats.
    constexpr double kMost = std::numeric_limits<float>::max();
    const auto& [lower, upper] = *bounds;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(lower[axis]) || !std::isfinite(upper[axis]) || lower[axis] > upper[axis])
            throw_bad_argument("bounds: must be finite, with lower <= upper");
        if (lower[axis] < -kMost || upper[axis] > kMost)
            throw_bad_argument("bounds: must be within the range of floats");
    }
}

Step step_of(mray::TreeStep step) {
    switch (step) {
        case mray::TreeStep::kBuilt:
            return Step::build;
        case mray::TreeStep::kKept:
            return Step::keep;
        case mray::TreeStep::kRefitted:
            return Step::refit;
        case mray::TreeStep::kRestructured:
            return Step::restructure;
        case mray::TreeStep::kRebuilt:
            return Step::rebuild;
        default:
            return Step::swap;
    }
}

Update to_public(const mray::TreeUpdate& update, double read_ms) {
    return {.step = step_of(update.step),
            .reason = update.reason,
            .cost_ratio = update.cost_ratio,
            .build_pending = update.build_pending,
            .read_ms = read_ms,
            .upload_ms = update.times.upload_ms,
            .refit_ms = update.times.refit_ms,
            .decide_ms = update.times.decide_ms,
            .restructure_ms = update.times.restructure_ms,
            .rebuild_ms = update.times.rebuild_ms};
}

}  // namespace

/// A call that changes the scene: keeps other threads out, and notes an error that leaves it of no
/// use.
class SceneImpl::Change {
public:
    explicit Change(SceneImpl& scene) : scene_(scene) {
        if (scene_.is_changing_.exchange(true)) {
            throw Error(ErrorCode::busy,
                        "another thread is changing this scene; update() takes one at a time");
        }
    }
    ~Change() { scene_.is_changing_ = false; }
    Change(const Change&) = delete;

    template <class Work>
    Update run(Work work) {
        scene_.require_usable();
        try {
            return with_public_errors([&] {
                work();
                return to_public(scene_.updater_->last(), scene_.read_ms_);
            });
        } catch (const Error& error) {
            scene_.broken_ = error;
            throw;
        }
    }

private:
    SceneImpl& scene_;
};

SceneImpl::SceneImpl(std::span<const MeshView> meshes, const Device& device,
                     const SceneOptions& options)
    : device_(device),
      options_(options),
      pose_((check(options.bounds), options.bounds), DeviceImpl::of(device).simd_target()),
      rays_(meshes_, DeviceImpl::of(device).simd_target()),
      shader_(DeviceImpl::of(device).simd_target()) {
    spec_of(options_.update);
    for (const MeshView& mesh : meshes) meshes_.attach(mesh);
    meshes_ = meshes_.changed();
    start(nullptr, nullptr);
}

SceneImpl::SceneImpl(const SceneImpl& other, const Device& device, const std::atomic<bool>* cancel)
    : device_(device),
      options_(other.options_),
      meshes_(other.meshes_),
      pose_(other.pose_),
      rays_(meshes_, DeviceImpl::of(device).simd_target()),
      shader_(DeviceImpl::of(device).simd_target()) {
    other.require_usable();
    options_.refit_on.reset();
    options_.cancel = cancel;
    options_.done = nullptr;
    mray::Bvh tree;
    {
        const std::scoped_lock lock(other.mutex_);
        other.tracer_->read_tree(tree);
    }
    start(&tree, nullptr);
}

/// Hands the meshes to the device with a tree, which is built if there is none. `before` is the
/// list that they were made of, or null.
void SceneImpl::start(const mray::Bvh* tree, const MeshList* before) {
    updater_.reset();
    if (tracer_ == nullptr) {
        tracer_ = DeviceImpl::of(device_).make_backend();
        queries_ = make_queries();
    }
    if (options_.refit_on && refitter_ == nullptr)
        refitter_ = DeviceImpl::of(*options_.refit_on).make_backend();
    const mray::Stopwatch watch;
    if (tree == nullptr) pose_.read_list(meshes_, before, arena());
    read_ms_ = watch.ms();
    rays_.set(pose_.space());
    shader_.set_meshes();
    mray::UpdateConfig config = config_of(options_.update);
    config.record_cost_ratio = options_.record_cost_ratio;
    const mray::BuildConfig build{.split = options_.split == Split::sweep
                                               ? mray::SplitMethod::kSweep
                                               : mray::SplitMethod::kBinned,
                                  .threads = DeviceImpl::of(device_).threads(),
                                  .watch = mray::Watch(options_.cancel, options_.done)};
    updater_ = std::make_unique<mray::TreeUpdater>(meshes_.topology(), pose_.positions(), *tracer_,
                                                   refitter_.get(), spec_of(options_.update), build,
                                                   config, tree);
    cost_.reset();
}

std::unique_ptr<const Queries> SceneImpl::make_queries() {
    if (const mray::RayQueries* const host = tracer_->queries())
        return std::make_unique<HostQueries>(*host, *tracer_, rays_, arena(), cost_);
    return std::make_unique<DeviceQueries>(*tracer_, mutex_, rays_, arena(), cost_);
}

void SceneImpl::require_usable() const {
    if (broken_) throw *broken_;
}

/// Brings the tree to the positions of pose_.
void SceneImpl::follow(std::span<const mray::IndexRange> changed, double read_ms) {
    read_ms_ = read_ms;
    rays_.set(pose_.space());
    shader_.set_pose();
    updater_->frame_done({.ms = cost_.ms(), .rays = cost_.rays()});
    cost_.reset();
    updater_->update(pose_.positions(), changed);
}

Update SceneImpl::update(bool takes_bounds) {
    Change change(*this);
    return change.run([&] {
        if (takes_bounds) pose_.forget_bounds();
        if (meshes_.has_changes()) {
            MeshList meshes = meshes_.changed();
            // The updater follows the topology that it was made for.
            updater_.reset();
            const MeshList before = std::exchange(meshes_, std::move(meshes));
            start(nullptr, &before);
            return;
        }
        const mray::Stopwatch watch;
        const std::vector<mray::IndexRange> changed = pose_.read_deforming(meshes_, arena());
        follow(changed, watch.ms());
    });
}

Update SceneImpl::update(std::uint32_t geom_id, std::size_t first, std::size_t count) {
    Change change(*this);
    require_usable();
    const MeshPlace* const mesh = meshes_.find(geom_id);
    if (mesh == nullptr)
        throw_bad_argument(fmt::format("the scene has no mesh with geom_id {}", geom_id));
    if (first > mesh->positions.count || count > mesh->positions.count - first) {
        throw_bad_argument(fmt::format("{} positions from number {} on, of a mesh that has {}",
                                       count, first, mesh->positions.count));
    }
    if (meshes_.has_changes()) {
        throw_bad_argument(
            "meshes have been attached or detached; call update() without a range first");
    }
    return change.run([&] {
        const mray::Stopwatch watch;
        const std::vector<mray::IndexRange> changed =
            pose_.read(meshes_, *mesh, first, count, arena());
        follow(changed, watch.ms());
    });
}

std::uint32_t SceneImpl::attach(const MeshView& mesh) {
    const Change change(*this);
    require_usable();
    return meshes_.attach(mesh);
}

void SceneImpl::detach(std::uint32_t geom_id) {
    const Change change(*this);
    require_usable();
    meshes_.detach(geom_id);
}

void SceneImpl::intersect(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence,
                          Threads threads, const std::atomic<bool>* cancel) const {
    require_usable();
    if (rays.size() != hits.size())
        throw_bad_argument(fmt::format("{} rays, but room for {} hits", rays.size(), hits.size()));
    queries_->intersect(rays, hits, coherence, threads, cancel);
}

Hit SceneImpl::intersect(const Ray& ray) const {
    require_usable();
    return queries_->intersect(ray);
}

void SceneImpl::occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                         Coherence coherence, Threads threads,
                         const std::atomic<bool>* cancel) const {
    require_usable();
    if (rays.size() != occluded.size()) {
        throw_bad_argument(
            fmt::format("{} rays, but room for {} answers", rays.size(), occluded.size()));
    }
    queries_->occluded(rays, occluded, coherence, threads, cancel);
}

bool SceneImpl::occluded(const Ray& ray) const {
    require_usable();
    return queries_->occluded(ray);
}

Update SceneImpl::last_update() const {
    require_usable();
    const std::scoped_lock lock(mutex_);
    return to_public(updater_->finish(), read_ms_);
}

}  // namespace morphray::detail
