#include "library/python/module/scene.h"

#include <fmt/format.h>
#include <sched.h>

#include <algorithm>
#include <csignal>

namespace morphray::python {
namespace {

// Below both limits queries take milliseconds. A handler of SIGINT takes tens of rays to set.
constexpr std::size_t kManyRays = std::size_t{1} << 14;
constexpr std::uint64_t kManyTests = std::uint64_t{1} << 24;

/// The call of the main thread that SIGINT ends, and the handlers at work in any thread.
std::atomic<std::atomic<bool>*> running = nullptr;
std::atomic<int> handlers = 0;
struct sigaction before;

void on_interrupt(int number) {
    ++handlers;
    if (std::atomic<bool>* const cancel = running) *cancel = true;
    before.sa_handler(number);
    --handlers;
}

/// Python runs handlers after C++. While this lives, SIGINT ends the main thread's call.
class SignalScope {
public:
    explicit SignalScope(std::atomic<bool>& cancel) {
        if (gettid() != getpid() || running != nullptr) return;
        sigaction(SIGINT, nullptr, &before);
        const bool is_handled = (before.sa_flags & SA_SIGINFO) == 0 &&
                                before.sa_handler != SIG_IGN && before.sa_handler != SIG_DFL;
        if (!is_handled) return;
        running = &cancel;
        is_set_ = true;
        struct sigaction action = before;
        action.sa_handler = on_interrupt;
        sigaction(SIGINT, &action, nullptr);
    }
    ~SignalScope() {
        if (!is_set_) return;
        sigaction(SIGINT, &before, nullptr);
        running = nullptr;
        while (handlers > 0) sched_yield();
    }
    SignalScope(const SignalScope&) = delete;

private:
    bool is_set_ = false;
};

/// SIGINT in the main thread makes `cancel` true. Throws what Python's handler raises then.
void run_interruptibly(std::atomic<bool>& cancel, const std::function<void()>& work) {
    try {
        const SignalScope scope(cancel);
        const GilRelease release;
        work();
    } catch (...) {
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        throw;
    }
}

void warn(const std::string& text) {
    if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 1) != 0) throw py::error_already_set();
}

template <class Lock>
Lock locked(Lock lock) {
    if (!lock) throw Error(ErrorCode::busy, "another thread is using this scene");
    return lock;
}

}  // namespace

BorrowedMesh borrow(const py::object& points, const py::object& triangles, bool deforms,
                    const py::object& albedo, const py::object& textures,
                    const std::string& place) {
    BorrowedMesh mesh;
    mesh.points = array_of(points, place + "points", 3);
    mesh.positions = positions_of(mesh.points, place + "points");
    mesh.triangles = indices_of(triangles, place + "triangles");
    mesh.albedo = albedo_of(albedo, place + "albedo");
    mesh.textures = textures_of(textures, place + "textures");
    mesh.deforms = deforms;
    return mesh;
}

PyScene::PyScene(const std::vector<BorrowedMesh>& meshes, const Device& device,
                 const SceneOptions& options, const std::optional<Point>& origin) {
    std::vector<MeshView> views;
    for (const BorrowedMesh& mesh : meshes) views.push_back(mesh.view());
    SceneOptions own = options;
    own.cancel = &cancel_build_;
    if (origin)
        own.origin = *origin;
    else if (meshes.empty())
        empty_options_ = own;
    else
        own.origin = find_origin(meshes.front().positions);
    run_interruptibly(cancel_build_, [&] {
        scene_ = Scene::build(std::span<const MeshView>(views), device, own);
    });
    for (const BorrowedMesh& mesh : meshes)
        points_.emplace(static_cast<std::uint32_t>(points_.size()), mesh.points);
    warn_of_points(scene_->last_update());
}

void PyScene::warn_if_open(FillRule rule) {
    if (has_checked_edges_[static_cast<std::size_t>(rule)].exchange(true)) return;
    const EdgeCounts edges = read([](const Scene& scene) { return scene.edge_counts(); });
    if (edges.is_closed(rule) && edges.twins == 0) return;
    warn(fmt::format(
        "edges: {} open, {} of more than two triangles, {} turned{}; insides and signs of "
        "distances need closed meshes{}",
        edges.open, edges.shared, edges.turned,
        edges.twins == 0 ? "" : fmt::format(", {} twins", edges.twins),
        rule == FillRule::nonzero && edges.is_closed(FillRule::odd) && edges.twins == 0
            ? R"(; rule="odd" is right where triangles are only turned)"
            : ""));
}

void PyScene::warn_of_points(const Update& update) {
    for (const auto& [geom_id, points] : points_) {
        if (has_warned_of_rounding_) break;
        if (!rounds_coarsely(positions_of(points, "points"), scene_->origin())) continue;
        has_warned_of_rounding_ = true;
        warn(
            fmt::format("points of mesh {}: rounding to float32 moves them by more than 1e-6 of "
                        "their size; origin, a point near them, keeps their digits",
                        geom_id));
    }
    for (const LeftOut& mesh : update.left_out) {
        if (!warned_of_left_out_.insert(mesh.geom_id).second) continue;
        warn(fmt::format(
            "points of mesh {}: {} are not finite and {} too far from all others{}; "
            "their triangles are never hit (Update.left_out)",
            mesh.geom_id, mesh.not_finite, mesh.too_far,
            mesh.too_small == 0
                ? ""
                : fmt::format(", and {} triangles too small beside the scene", mesh.too_small)));
    }
}

Update PyScene::run_change(const std::function<Update()>& change,
                           const std::function<void()>& take_points) {
    Update update;
    // A signal that came after the last build has not ended it.
    cancel_build_ = false;
    run_interruptibly(cancel_build_, [&] { update = change(); });
    if (take_points) take_points();
    warn_of_points(update);
    return update;
}

/// Cancels a background build and waits for its end.
PyScene::~PyScene() {
    const GilRelease release;
    scene_.reset();
}

std::shared_lock<std::shared_mutex> PyScene::query_lock() {
    return locked(std::shared_lock(mutex_, std::try_to_lock));
}
std::unique_lock<std::shared_mutex> PyScene::change_lock() {
    return locked(std::unique_lock(mutex_, std::try_to_lock));
}

Update PyScene::update(bool takes_bounds) {
    const std::unique_lock lock = change_lock();
    return run_change(
        [&] { return takes_bounds ? scene_->update_with_new_bounds() : scene_->update(); },
        [&] { detached_points_.clear(); });
}

Update PyScene::update(std::uint32_t geom_id, std::size_t first, std::optional<std::size_t> count) {
    const std::unique_lock lock = change_lock();
    if (!count) {
        const auto points = points_.find(geom_id);
        const std::size_t all =
            points == points_.end() ? 0 : static_cast<std::size_t>(points->second.shape(0));
        count = all - std::min(first, all);
    }
    return run_change([&] { return scene_->update(geom_id, first, *count); });
}

Update PyScene::update(std::uint32_t geom_id, const py::object& points) {
    const py::array array = array_of(points, "points", 3);
    const Positions positions = positions_of(array, "points");
    const std::unique_lock lock = change_lock();
    return run_change([&] { return scene_->update(geom_id, positions); },
                      [&] { points_.insert_or_assign(geom_id, array); });
}

Update PyScene::update(const std::vector<MeshPose>& poses) {
    const std::unique_lock lock = change_lock();
    return run_change([&] { return scene_->update(poses); });
}

std::uint32_t PyScene::attach(const BorrowedMesh& mesh) {
    const std::unique_lock lock = change_lock();
    const std::uint32_t geom_id = [&] {
        const GilRelease release;
        if (!empty_options_) return scene_->attach(mesh.view());
        empty_options_->origin = find_origin(mesh.positions);
        Scene scene = Scene::build(std::span<const MeshView>(), device(), *empty_options_);
        const std::uint32_t first = scene.attach(mesh.view());
        scene_ = std::move(scene);
        empty_options_.reset();
        return first;
    }();
    points_.insert_or_assign(geom_id, mesh.points);
    warned_of_left_out_.erase(geom_id);
    for (std::atomic<bool>& has_checked : has_checked_edges_) has_checked = false;
    return geom_id;
}

void PyScene::detach(std::uint32_t geom_id) {
    const std::unique_lock lock = change_lock();
    scene_->detach(geom_id);
    detached_points_.push_back(std::move(points_.extract(geom_id).mapped()));
}

void PyScene::query(std::size_t count, Cancel* cancel,
                    const std::function<void(const Scene&, const std::atomic<bool>*)>& work) {
    const std::shared_lock lock = query_lock();
    std::atomic<bool> cancelled = false;
    const Cancel::Use use(cancel, cancelled);
    const auto run = [&] { work(*scene_, &cancelled); };
    if (count >= kManyRays || count * scene_->triangle_count() >= kManyTests)
        return run_interruptibly(cancelled, run);
    const GilRelease release;
    run();
}

std::unique_ptr<PyScene> PyScene::on(const Device& device) {
    const std::shared_lock lock = query_lock();
    std::unique_ptr<PyScene> copy(new PyScene);
    copy->points_ = points_;
    copy->detached_points_ = detached_points_;
    const GilRelease release;
    copy->scene_ = scene_->on(device, &copy->cancel_build_);
    return copy;
}

}  // namespace morphray::python
