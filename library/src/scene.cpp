#include "morphray/scene.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "common/frame_times.h"
#include "common/scene/mesh.h"
#include "library/src/scene_impl.h"

namespace morphray {
namespace detail {
namespace {

/// Throws Error(bad_argument) for a budget or a number of poses out of range.
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

mray::UpdateConfig config_of(const UpdatePolicy& policy) {
    const auto* const automatic = std::get_if<Auto>(&policy);
    if (automatic == nullptr) return {};
    return {.deterministic = automatic->deterministic,
            .budget = automatic->budget,
            .budget_ms = automatic->budget_ms};
}

}  // namespace

std::vector<mray::IndexRange> SceneImpl::read_list() {
    const mray::Stopwatch watch;
    std::vector<mray::IndexRange> moved = pose.read_list(meshes, arena());
    left_out = pose.left_out(meshes);
    read_ms = watch.ms();
    normals.reset();
    edge_counts.reset();
    return moved;
}

void SceneImpl::took_pose() {
    space.emplace(pose.space(), target());
    has_normals = false;
    pose_tree.reset();
}

void SceneImpl::start(const mray::Bvh* tree) {
    updater.reset();
    if (tracer == nullptr) tracer = DeviceImpl::of(device).make_backend();
    took_pose();
    mray::UpdateConfig config = config_of(options.update);
    config.record_cost_ratio = options.record_cost_ratio;
    const mray::BuildConfig build{.threads = DeviceImpl::of(device).threads(),
                                  .watch = mray::Watch(options.cancel)};
    updater = std::make_unique<mray::TreeUpdater>(meshes.topology(), pose.positions(), *tracer,
                                                  spec_of(options.update), build, config, tree);
    cost.reset();
}

void SceneImpl::change_meshes() {
    updater->end_background_build();
    const mray::TopologyChange change = meshes.make_changes();
    const mray::SceneSpace space_before = pose.space();
    const std::vector<mray::IndexRange> moved = read_list();
    if (pose.space() == space_before && updater->change_topology(pose.positions(), change, moved)) {
        took_pose();
        cost.reset();
    } else {
        start(nullptr);
    }
}

void SceneImpl::follow(std::span<const PoseReader::Piece> pieces) {
    const mray::Stopwatch watch;
    const std::vector<mray::IndexRange> changed = pose.read_pieces(meshes, pieces, arena());
    left_out = pose.left_out(meshes);
    read_ms = watch.ms();
    took_pose();
    updater->frame_done({.ms = cost.ms(), .rays = cost.rays()});
    cost.reset();
    updater->update(pose.positions(), changed);
}

}  // namespace detail

namespace {

using detail::MeshList;
using detail::SceneImpl;
using detail::throw_bad_argument;
using detail::with_public_errors;
using detail::with_scene;

void check_bounds(const SceneOptions& options) {
    // Positions are floats.
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

// Both name the same steps in one order.
static_assert(static_cast<int>(Step::swap) == static_cast<int>(mray::TreeStep::kSwapped));

Update to_public(const mray::TreeUpdate& update, const SceneImpl& scene) {
    return {.step = static_cast<Step>(update.step),
            .reason = update.reason,
            .cost_ratio = update.cost_ratio,
            .build_pending = update.build_pending,
            .left_out = scene.left_out,
            .read_ms = scene.read_ms,
            .upload_ms = update.times.upload_ms,
            .refit_ms = update.times.refit_ms,
            .decide_ms = update.times.decide_ms,
            .restructure_ms = update.times.restructure_ms,
            .rebuild_ms = update.times.rebuild_ms};
}

/// A call that changes the scene: keeps other threads out, and notes a fatal error.
class Change {
public:
    explicit Change(const std::unique_ptr<SceneImpl>& impl) : scene_(require(impl)) {
        if (scene_.is_changing.exchange(true)) {
            throw Error(ErrorCode::busy,
                        "another thread is changing this scene; update() takes one at a time");
        }
    }
    ~Change() { scene_.is_changing = false; }
    Change(const Change&) = delete;

    SceneImpl& usable() const {
        scene_.require_usable();
        return scene_;
    }

    template <class Work>
    Update run(Work work) {
        usable();
        try {
            return with_public_errors([&] {
                work(scene_);
                return to_public(scene_.updater->last(), scene_);
            });
        } catch (const Error& error) {
            scene_.broken = error;
            throw;
        }
    }

private:
    SceneImpl& scene_;
};

/// Reads positions [first, first + count) of a mesh; prepare(scene, mesh) returns both.
template <class Prepare>
Update update_mesh(const std::unique_ptr<SceneImpl>& impl, std::uint32_t geom_id, Prepare prepare) {
    return with_public_errors([&] {
        Change change(impl);
        SceneImpl& scene = change.usable();
        const detail::MeshPlace* const mesh = scene.meshes.find(geom_id);
        if (mesh == nullptr) throw_bad_argument("the scene has no mesh with geom_id {}", geom_id);
        if (scene.meshes.has_changes()) {
            throw_bad_argument(
                "meshes have been attached or detached; call update() without a mesh first");
        }
        const std::pair<std::size_t, std::size_t> range = prepare(scene, *mesh);
        return change.run([&](SceneImpl& changed) {
            changed.follow(
                std::vector<detail::PoseReader::Piece>{{mesh, range.first, range.second}});
        });
    });
}

/// Scene::update(), and update_with_new_bounds() if it takes bounds.
Update update_all(const std::unique_ptr<SceneImpl>& impl, bool takes_bounds) {
    return with_public_errors([&] {
        return Change(impl).run([&](SceneImpl& scene) {
            if (takes_bounds) scene.pose.forget_bounds();
            if (scene.meshes.has_changes()) {
                scene.change_meshes();
                return;
            }
            std::vector<detail::PoseReader::Piece> pieces;
            for (const detail::MeshPlace& mesh : scene.meshes.places())
                if (mesh.used && mesh.deforms) pieces.push_back({&mesh, 0, mesh.positions.count});
            scene.follow(pieces);
        });
    });
}

}  // namespace

UpdatePolicy parse_update_policy(const std::string& text) {
    return with_public_errors([&]() -> UpdatePolicy {
        const mray::PolicySpec spec = mray::parse_policy(text);
        switch (spec.kind) {
            case mray::PolicyKind::kRefit:
                return Refit{};
            case mray::PolicyKind::kRebuild:
                return Rebuild{};
            case mray::PolicyKind::kEvery:
                return Every{spec.period};
            default:
                return Auto{};
        }
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
    return with_public_errors([&] {
        check_bounds(options);
        detail::spec_of(options.update);
        auto scene = std::make_unique<SceneImpl>(
            device, options,
            detail::PoseReader(options.bounds, options.origin,
                               detail::DeviceImpl::of(device).simd_target()));
        for (const MeshView& mesh : meshes) scene->meshes.attach(mesh);
        scene->meshes.make_changes();
        scene->read_list();
        scene->start(nullptr);
        return Scene(std::move(scene));
    });
}

Scene Scene::on(const Device& device, const std::atomic<bool>* cancel) const {
    return with_scene(impl_, [&](SceneImpl& scene) {
        SceneOptions options = scene.options;
        options.cancel = cancel;
        auto other = std::make_unique<SceneImpl>(device, options, scene.pose);
        other->meshes = scene.meshes;
        other->left_out = scene.left_out;
        mray::Bvh tree;
        {
            const std::scoped_lock lock(scene.mutex);
            scene.tracer->read_tree(tree);
        }
        other->start(&tree);
        return Scene(std::move(other));
    });
}

Update Scene::update() { return update_all(impl_, false); }

Update Scene::update_with_new_bounds() { return update_all(impl_, true); }

Update Scene::update(std::uint32_t geom_id, std::size_t first, std::size_t count) {
    return update_mesh(impl_, geom_id, [&](SceneImpl&, const detail::MeshPlace& mesh) {
        if (first > mesh.positions.count || count > mesh.positions.count - first) {
            throw_bad_argument("{} positions from number {} on, of a mesh that has {}", count,
                               first, mesh.positions.count);
        }
        return std::pair(first, count);
    });
}

Update Scene::update(std::uint32_t geom_id, const Positions& positions) {
    return update_mesh(impl_, geom_id, [&](SceneImpl& scene, const detail::MeshPlace&) {
        scene.meshes.set_positions(geom_id, positions);
        return std::pair(std::size_t{0}, positions.count);
    });
}

std::uint32_t Scene::attach(const MeshView& mesh) {
    return with_public_errors([&] { return Change(impl_).usable().meshes.attach(mesh); });
}

void Scene::detach(std::uint32_t geom_id) {
    with_public_errors([&] { Change(impl_).usable().meshes.detach(geom_id); });
}

Update Scene::last_update() const {
    return with_scene(impl_, [](SceneImpl& scene) {
        const std::scoped_lock lock(scene.mutex);
        return to_public(scene.updater->finish(), scene);
    });
}

EdgeCounts Scene::edge_counts() const {
    return with_scene(impl_, [](SceneImpl& scene) {
        const std::scoped_lock lock(scene.mutex);
        if (!scene.edge_counts) {
            const mray::EdgeCounts counts =
                mray::count_edges(scene.meshes.topology(), scene.pose.positions());
            scene.edge_counts = {counts.open, counts.shared, counts.turned, counts.uneven,
                                 counts.twins};
        }
        return *scene.edge_counts;
    });
}

const Device& Scene::device() const { return require(impl_).device; }

const Point& Scene::origin() const { return require(impl_).options.origin; }

Vec3 Scene::less_origin(const Point& point) const {
    const mray::vec3 p = require(impl_).pose.origin().to_world({point[0], point[1], point[2]});
    return {p.x, p.y, p.z};
}

Point Scene::plus_origin(const Vec3& point) const {
    const glm::dvec3 p = require(impl_).pose.origin().from_world({point.x, point.y, point.z});
    return {p.x, p.y, p.z};
}

std::uint64_t Scene::triangle_count() const {
    return require(impl_).meshes.topology().triangles.size();
}

std::uint64_t Scene::vertex_count() const { return require(impl_).meshes.topology().vertex_count; }

}  // namespace morphray
