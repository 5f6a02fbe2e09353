#include "morphray/scene.hpp"

#include <glm/common.hpp>

#include "common/bvh/box.h"
#include "common/bvh/bvh.h"
#include "common/scene/camera_setup.h"
#include "library/src/scene_impl.h"

namespace morphray {
namespace detail {
namespace {

void check_bounds(const SceneOptions& options) {
    constexpr double kMost = std::numeric_limits<float>::max();
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double origin = options.origin[axis];
        if (!std::isfinite(origin)) throw_bad_argument("origin: must be finite");
        if (!options.bounds) continue;
        const double lower = options.bounds->lower[axis];
        const double upper = options.bounds->upper[axis];
        if (!std::isfinite(lower) || !std::isfinite(upper) || lower > upper)
            throw_bad_argument("bounds: must be finite, with lower <= upper");
        if (lower - origin < -kMost || upper - origin > kMost)
            throw_bad_argument("bounds: must be within the range of floats");
    }
}

mray::PolicySpec spec_of(const UpdatePolicy& policy) {
    if (std::holds_alternative<Refit>(policy)) return {mray::PolicyKind::kRefit};
    if (std::holds_alternative<Rebuild>(policy)) return {mray::PolicyKind::kRebuild};
    if (const auto* const every = std::get_if<Every>(&policy)) {
        if (every->poses >= 1 && every->poses <= mray::kMostPeriod)
            return {mray::PolicyKind::kEvery, every->poses};
        throw_bad_argument("Every: a tree is used for 1 to {} poses, not for {}", mray::kMostPeriod,
                           every->poses);
    }
    const Auto& automatic = std::get<Auto>(policy);
    for (const auto& [name, budget] :
         {std::pair("budget_ms", automatic.budget_ms), std::pair("budget", automatic.budget)}) {
        if (std::isfinite(budget) && budget >= 0) continue;
        throw_bad_argument("Auto: {} is {}; give a finite number that is not negative", name,
                           budget);
    }
    return {mray::PolicyKind::kAuto};
}

mray::Transform rounded(const MeshPose& pose, const mray::Origin& origin) {
    const auto& rows = pose.transform.rows;
    const mray::vec3 t = origin.to_world({rows[0][3], rows[1][3], rows[2][3]});
    const auto row = [&](std::size_t axis) {
        const mray::vec3 m = mray::Origin().to_world({rows[axis][0], rows[axis][1], rows[axis][2]});
        const float last = t[static_cast<int>(axis)];
        if (mray::all_finite(m) && std::isfinite(last)) return mray::vec4(m, last);
        throw_bad_argument("the pose of mesh {} has a number that is not finite or beyond floats",
                           pose.geom_id);
    };
    return {row(0), row(1), row(2)};
}

const SceneOptions& checked(const SceneOptions& options) {
    check_bounds(options);
    spec_of(options.update);
    return options;
}

/// Calls work(scene), which changes it, as with_scene().
template <class Work>
decltype(auto) with_change(const std::unique_ptr<SceneImpl>& impl, Work work) {
    return with_public_errors([&]() -> decltype(auto) {
        SceneImpl& scene = require(impl);
        const auto lock = scene.change_lock();
        return work(scene);
    });
}

}  // namespace

SceneImpl::SceneImpl(std::span<const MeshView> meshes, const Device& device,
                     const SceneOptions& options)
    : device_(device),
      options_(checked(options)),
      pose_(options.bounds, options.origin, target()),
      tracer_(DeviceImpl::of(device).make_backend()) {
    for (const MeshView& mesh : meshes) meshes_.attach(mesh);
    change_meshes();
}

SceneImpl::SceneImpl(const SceneImpl& other, const Device& device, const std::atomic<bool>* cancel)
    : device_(device),
      options_(other.options_),
      meshes_(other.meshes_),
      pose_(other.pose_),
      space_(std::in_place, pose_.space(), target()),
      tracer_(DeviceImpl::of(device).make_backend()),
      left_out_(other.left_out_) {
    options_.cancel = cancel;
    mray::Bvh tree;
    other.tracer_->read_tree(tree);
    start(&tree);
}

/// Hands the meshes to the tracer with a tree, which is built if there is none.
void SceneImpl::start(const mray::Bvh* tree) {
    const mray::BuildConfig build{.threads = DeviceImpl::of(device_).threads,
                                  .watch = mray::Watch(options_.cancel)};
    mray::UpdateConfig config{.record_cost_ratio = options_.record_cost_ratio};
    if (const auto* const automatic = std::get_if<Auto>(&options_.update)) {
        config.deterministic = automatic->deterministic;
        config.budget = automatic->budget;
        config.budget_ms = automatic->budget_ms;
    }
    // Deterministic decisions are the same for all tracers.
    if (!config.deterministic) config.first_per_visit = tracer_->info().trace_per_visit;
    updater_ = std::make_unique<mray::TreeUpdater>(
        meshes_.topology(), pose_.pose(), *tracer_,
        mray::make_update_policy(spec_of(options_.update), config), build, config, tree);
    cost.reset();
}

/// Calls read(), which brings the pose to the caller's positions.
template <class Read>
void SceneImpl::read_pose(Read read) {
    const mray::Stopwatch watch;
    read();
    left_out_ = pose_.left_out(meshes_);
    read_ms_ = watch.ms();
    space_.emplace(pose_.space(), target());
    has_normals_of_pose_ = false;
}

void SceneImpl::read_positions(std::span<const MeshVertices> vertices) {
    read_pose([&] { pose_.read(meshes_, vertices, arena()); });
}

std::unique_lock<std::mutex> SceneImpl::change_lock() {
    std::unique_lock lock(change_mutex_, std::try_to_lock);
    if (!lock)
        throw Error(ErrorCode::busy,
                    "another thread is changing this scene; update() takes one at a time");
    require_usable();
    return lock;
}

/// Calls work(), which changes the tree. Its errors break the scene.
template <class Work>
Update SceneImpl::run_update(Work work) {
    try {
        return with_public_errors([&] {
            work();
            return to_public(updater_->last());
        });
    } catch (const Error& error) {
        broken_ = error;
        throw;
    }
}

Update SceneImpl::update_all(bool takes_bounds) {
    return run_update([&] {
        if (takes_bounds) pose_.forget_bounds();
        if (meshes_.has_changes()) return change_meshes();
        follow(meshes_.deforming_vertices());
    });
}

const MeshSlot& SceneImpl::mesh_to_update(std::uint32_t geom_id) const {
    const MeshSlot* const mesh = meshes_.find(geom_id);
    if (mesh == nullptr) throw_bad_argument("the scene has no mesh with geom_id {}", geom_id);
    if (meshes_.has_changes())
        throw_bad_argument(
            "meshes have been attached or detached; call update() without a mesh first");
    return *mesh;
}

Update SceneImpl::update_vertices(std::uint32_t geom_id, std::size_t first, std::size_t count) {
    return run_update([&] {
        meshes_.read_rest(geom_id, first, count);
        follow(std::array{MeshVertices{meshes_.find(geom_id), first, count}});
    });
}

void SceneImpl::change_meshes() {
    knows_meshes_of_subtrees_ = false;
    // Ends a build in the background, which reads the topology.
    updater_.reset();
    // A refit that is pending, or has failed, needs the positions as they are.
    tracer_->finish();
    meshes_.make_changes();
    read_pose([&] { pose_.read_list(meshes_, arena()); });
    normals_.reset();
    edge_counts_.reset();
    start(nullptr);
}

void SceneImpl::follow(std::span<const MeshVertices> vertices) {
    updater_->frame_done(
        {.ms = cost.ms(), .rays = cost.rays(), .other_rays = cost.rays() - cost.image_rays()});
    cost.reset();
    read_positions(vertices);
    const mray::TreeStep step = updater_->update().step;
    // These keep the tree as it is but for its boxes.
    if (step != mray::TreeStep::kKept && step != mray::TreeStep::kRefitted)
        knows_meshes_of_subtrees_ = false;
}

// Both name the same steps in one order.
static_assert(static_cast<int>(Step::swap) == static_cast<int>(mray::TreeStep::kSwapped));

Update SceneImpl::to_public(const mray::TreeUpdate& update) const {
    return {.step = static_cast<Step>(update.step),
            .reason = update.reason,
            .cost_ratio = update.cost_ratio,
            .build_pending = update.build_pending,
            .left_out = left_out_,
            .read_ms = read_ms_,
            .upload_ms = update.times.upload_ms,
            .refit_ms = update.times.refit_ms,
            .decide_ms = update.times.decide_ms,
            .restructure_ms = update.times.restructure_ms,
            .rebuild_ms = update.times.rebuild_ms};
}

std::span<const std::uint32_t> SceneImpl::meshes_of_subtrees() {
    if (knows_meshes_of_subtrees_) return meshes_of_subtrees_;
    const std::scoped_lock lock(mutex_);
    if (knows_meshes_of_subtrees_) return meshes_of_subtrees_;
    std::vector<std::uint32_t> meshes;
    for (const mray::IndexRange& prims : mray::prim_ranges(tracer_->host_tree())) {
        const auto mesh_of = [&](std::uint32_t prim) {
            return meshes_.locate(0, 0, 0, prim).geom_id;
        };
        const bool has_one =
            prims.begin < prims.end && mesh_of(prims.begin) == mesh_of(prims.end - 1);
        meshes.push_back(has_one ? mesh_of(prims.begin) : kNoGeometry);
    }
    meshes_of_subtrees_ = std::move(meshes);
    knows_meshes_of_subtrees_ = true;
    return meshes_of_subtrees_;
}

const mray::VertexNormals& SceneImpl::normals() {
    if (!has_normals_of_pose_) {
        if (!normals_) normals_.emplace(meshes_.topology().triangles, meshes_.normal_ids());
        arena().execute([&] { normals_->update(pose_.positions()); });
        has_normals_of_pose_ = true;
    }
    return *normals_;
}

}  // namespace detail

using namespace detail;

UpdatePolicy parse_update_policy(const std::string& text) {
    return with_public_errors([&]() -> UpdatePolicy {
        const mray::PolicySpec spec = mray::parse_policy(text);
        if (spec.kind == mray::PolicyKind::kRefit) return Refit{};
        if (spec.kind == mray::PolicyKind::kRebuild) return Rebuild{};
        if (spec.kind == mray::PolicyKind::kEvery) return Every{spec.period};
        return Auto{};
    });
}

const char* to_string(Step step) noexcept {
    return mray::name_of(static_cast<mray::TreeStep>(step));
}

Scene::Scene(std::unique_ptr<SceneImpl> impl) : impl_(std::move(impl)) {}
Scene::Scene(Scene&& other) noexcept = default;
Scene& Scene::operator=(Scene&& other) noexcept = default;
Scene::~Scene() = default;

Scene Scene::build(const MeshView& mesh, const Device& device, const SceneOptions& options) {
    return build(std::span<const MeshView>(&mesh, 1), device, options);
}

Scene Scene::build(std::span<const MeshView> meshes, const Device& device,
                   const SceneOptions& options) {
    return with_public_errors(
        [&] { return Scene(std::make_unique<SceneImpl>(meshes, device, options)); });
}

Scene Scene::on(const Device& device, const std::atomic<bool>* cancel) const {
    return with_scene(impl_, [&](SceneImpl& scene) {
        return Scene(std::make_unique<SceneImpl>(scene, device, cancel));
    });
}

Update Scene::update() {
    return with_change(impl_, [](SceneImpl& scene) { return scene.update_all(false); });
}
Update Scene::update_with_new_bounds() {
    return with_change(impl_, [](SceneImpl& scene) { return scene.update_all(true); });
}

Update Scene::update(std::uint32_t geom_id, std::size_t first, std::size_t count) {
    return with_change(impl_, [&](SceneImpl& scene) {
        const std::size_t all = scene.mesh_to_update(geom_id).positions.count;
        if (first > all || count > all - first)
            throw_bad_argument("{} positions from number {} on, of a mesh that has {}", count,
                               first, all);
        return scene.update_vertices(geom_id, first, count);
    });
}
Update Scene::update(std::uint32_t geom_id, const Positions& positions) {
    return with_change(impl_, [&](SceneImpl& scene) {
        scene.mesh_to_update(geom_id);
        scene.meshes_.set_positions(geom_id, positions);
        return scene.update_vertices(geom_id, 0, positions.count);
    });
}

Update Scene::update(std::span<const MeshPose> poses) {
    return with_change(impl_, [&](SceneImpl& scene) {
        std::vector<mray::Transform> transforms;
        std::vector<MeshVertices> moved;
        for (const MeshPose& pose : poses) {
            const MeshSlot& mesh = scene.mesh_to_update(pose.geom_id);
            moved.push_back({&mesh, 0, mesh.positions.count});
            transforms.push_back(rounded(pose, scene.pose().origin()));
        }
        // Backends take vertices in ascending order.
        std::ranges::sort(moved, {}, &MeshVertices::mesh);
        const auto twice = std::ranges::adjacent_find(moved, {}, &MeshVertices::mesh);
        if (twice != moved.end())
            throw_bad_argument("geom_id {} has several poses",
                               twice->mesh - scene.meshes().slots().data());
        return scene.run_update([&] {
            for (std::size_t i = 0; i < poses.size(); ++i)
                scene.meshes_.set_transform(poses[i].geom_id, transforms[i]);
            scene.follow(moved);
        });
    });
}
Update Scene::update(std::uint32_t geom_id, const Transform& transform) {
    const MeshPose pose{geom_id, transform};
    return update(std::span(&pose, 1));
}

std::uint32_t Scene::attach(const MeshView& mesh) {
    return with_change(impl_, [&](SceneImpl& scene) { return scene.meshes_.attach(mesh); });
}
void Scene::detach(std::uint32_t geom_id) {
    with_change(impl_, [&](SceneImpl& scene) { scene.meshes_.detach(geom_id); });
}

Update Scene::last_update() const {
    return with_scene(impl_, [](SceneImpl& scene) {
        const std::scoped_lock lock(scene.mutex());
        return scene.to_public(scene.updater_->finish());
    });
}

TreeStatistics Scene::tree_statistics() const {
    return with_scene(impl_, [](SceneImpl& scene) -> TreeStatistics {
        const mray::Bvh& tree = scene.tracer().host_tree();
        const mray::BvhStats stats = mray::bvh_stats(tree);
        return {stats.sah_cost, stats.node_count, stats.leaf_count,
                stats.depth,    stats.bytes,      mray::bvh_hash(tree)};
    });
}

std::vector<Box> Scene::tree_boxes(std::uint32_t depth) const {
    return with_scene(impl_, [&](SceneImpl& scene) {
        const mray::Bvh& tree = scene.tracer().host_tree();
        std::vector<Box> boxes;
        const auto corner = [&](const mray::vec3& p) {
            const glm::dvec3 world(scene.pose().space().to_world(p));
            return mray::to_point(scene.pose().origin().from_world(world));
        };
        const auto add = [&](const mray::Box& box) {
            if (!box.empty()) boxes.push_back({corner(box.lower), corner(box.upper)});
        };
        if (depth == 0) add(mray::node_box(tree.nodes.front()));
        if (depth == 0 || depth > tree.depth()) return boxes;
        // The slots of a level hold the boxes of the next one.
        for (std::uint32_t i = tree.level_begin[depth - 1]; i < tree.level_begin[depth]; ++i)
            for (std::uint32_t slot = 0; slot < mray::kWidth; ++slot)
                add(mray::slot_box(tree.nodes[i], slot));
        return boxes;
    });
}

Box Scene::bounds() const {
    return with_scene(impl_, [](SceneImpl& scene) {
        glm::dvec3 lower(std::numeric_limits<double>::infinity());
        glm::dvec3 upper = -lower;
        const PoseReader& pose = scene.pose();
        for (std::uint32_t vertex = 0; vertex < pose.positions().size(); ++vertex) {
            if (pose.positions()[vertex].x == mray::kInvalidCoordinate) continue;
            const glm::dvec3 p = pose.origin().from_world(glm::dvec3(pose.world_position(vertex)));
            lower = glm::min(lower, p);
            upper = glm::max(upper, p);
        }
        return Box{mray::to_point(lower), mray::to_point(upper)};
    });
}

EdgeCounts Scene::edge_counts() const {
    return with_scene(impl_, [](SceneImpl& scene) {
        const std::scoped_lock lock(scene.mutex());
        if (!scene.edge_counts_) {
            const mray::EdgeCounts counts =
                mray::count_edges(scene.meshes().topology(), scene.pose().positions());
            scene.edge_counts_ = {counts.open, counts.shared, counts.turned, counts.uneven,
                                  counts.twins};
        }
        return *scene.edge_counts_;
    });
}

const Device& Scene::device() const { return require(impl_).device(); }
const Point& Scene::origin() const { return require(impl_).options().origin; }

Vec3 Scene::less_origin(const Point& point) const {
    const mray::vec3 p = require(impl_).pose().origin().to_world({point[0], point[1], point[2]});
    return {p.x, p.y, p.z};
}
Point Scene::plus_origin(const Vec3& point) const {
    const glm::dvec3 p = require(impl_).pose().origin().from_world({point.x, point.y, point.z});
    return {p.x, p.y, p.z};
}

std::uint64_t Scene::triangle_count() const {
    return require(impl_).meshes().topology().triangles.size();
}
std::uint64_t Scene::vertex_count() const {
    return require(impl_).meshes().topology().vertex_count;
}

}  // namespace morphray
