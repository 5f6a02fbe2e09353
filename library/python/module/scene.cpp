#include "library/python/module/scene.h"

#include <sched.h>

#include <algorithm>
#include <csignal>

namespace morphray::python {
namespace {

// Rays that are converted and traced together.
constexpr std::size_t kBatch = std::size_t{1} << 16;
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

template <class Lock>
Lock locked(Lock lock) {
    if (!lock) throw Error(ErrorCode::busy, "another thread is using this scene");
    return lock;
}

}  // namespace

std::size_t batch_size(const QueryArray& rays, Coherence coherence) {
    if (rays.columns == 8) return rays.count;
    const std::size_t rows = 8 * std::max<std::size_t>(coherence.width, 1);
    return std::max(kBatch / rows, std::size_t{1}) * rows;
}

void for_each_batch(const QueryArray& rays, std::size_t batch_size,
                    const std::function<void(std::size_t, std::span<const Ray>)>& work) {
    std::vector<Ray> converted;
    std::size_t first = 0;
    do {
        const std::size_t count = std::min(batch_size, rays.count - first);
        const float* from = rays.data + first * rays.columns;
        if (rays.columns == 8) {
            // Ray is laid out as eight floats.
            work(first, std::span(reinterpret_cast<const Ray*>(from), count));
        } else {
            converted.resize(count);
            for (Ray& ray : converted) {
                ray = {.org = {from[0], from[1], from[2]}, .dir = {from[3], from[4], from[5]}};
                from += 6;
            }
            work(first, std::span<const Ray>(converted));
        }
        first += count;
    } while (first < rays.count);
}

BorrowedMesh borrow(const py::object& points, const py::object& triangles, bool deforms,
                    const py::object& albedo, const py::object& textures,
                    const std::string& place) {
    BorrowedMesh mesh;
    mesh.points = array_of(points, place + "points");
    mesh.positions = positions_of(mesh.points, place + "points");
    mesh.triangles = indices_of(triangles, place + "triangles");
    mesh.albedo = albedo_of(albedo, place + "albedo");
    mesh.textures = textures_of(textures, place + "textures");
    mesh.deforms = deforms;
    return mesh;
}

PyScene::PyScene(const std::vector<BorrowedMesh>& meshes, const Device& device,
                 const SceneOptions& options) {
    std::vector<MeshView> views;
    for (const BorrowedMesh& mesh : meshes) views.push_back(mesh.view());
    SceneOptions cancellable = options;
    cancellable.cancel = &cancel_build_;
    run_interruptibly(cancel_build_, [&] {
        scene_ = Scene::build(std::span<const MeshView>(views), device, cancellable);
    });
    for (const BorrowedMesh& mesh : meshes)
        points_.emplace(static_cast<std::uint32_t>(points_.size()), mesh.points);
    next_points_ = points_;
    for (const MeshView& view : views) warn_if_coarse(view.positions);
}

void PyScene::warn_if_coarse(const Positions& positions) {
    if (!positions.has_doubles || has_warned_) return;
    if (!size_) {
        const Box bounds = scene_->bounds();
        size_ = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            size_ = std::max(*size_, bounds.upper[axis] - bounds.lower[axis]);
    }
    constexpr double kCoarse = 1e-6;
    has_warned_ = *size_ > 0 && rounding_error(positions, scene_->origin()) > kCoarse * *size_;
    if (!has_warned_) return;
    const char* const text =
        "points: rounding to float32 moves them by more than 1e-6 of the size of the scene; "
        "origin, a point near them, keeps their digits";
    if (PyErr_WarnEx(PyExc_UserWarning, text, 1) != 0) throw py::error_already_set();
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
    Update update;
    std::map<std::uint32_t, py::array> points = next_points_;
    // A signal that came after the last build has not ended it.
    cancel_build_ = false;
    run_interruptibly(cancel_build_, [&] {
        update = takes_bounds ? scene_->update_with_new_bounds() : scene_->update();
        points_.swap(points);
    });
    return update;
}

Update PyScene::update(std::uint32_t geom_id, std::size_t first, std::optional<std::size_t> count) {
    const std::unique_lock lock = change_lock();
    if (!count) {
        const auto points = points_.find(geom_id);
        const std::size_t all =
            points == points_.end() ? 0 : static_cast<std::size_t>(points->second.shape(0));
        count = all - std::min(first, all);
    }
    Update update;
    cancel_build_ = false;
    run_interruptibly(cancel_build_, [&] { update = scene_->update(geom_id, first, *count); });
    return update;
}

Update PyScene::update(std::uint32_t geom_id, const py::object& points) {
    const py::array array = array_of(points, "points");
    const Positions positions = positions_of(array, "points");
    const std::unique_lock lock = change_lock();
    Update update;
    cancel_build_ = false;
    run_interruptibly(cancel_build_, [&] { update = scene_->update(geom_id, positions); });
    points_.insert_or_assign(geom_id, array);
    next_points_.insert_or_assign(geom_id, array);
    return update;
}

std::uint32_t PyScene::attach(const BorrowedMesh& mesh) {
    const std::unique_lock lock = change_lock();
    std::uint32_t geom_id = 0;
    {
        const GilRelease release;
        geom_id = scene_->attach(mesh.view());
    }
    next_points_.insert_or_assign(geom_id, mesh.points);
    warn_if_coarse(mesh.positions);
    return geom_id;
}

void PyScene::detach(std::uint32_t geom_id) {
    const std::unique_lock lock = change_lock();
    scene_->detach(geom_id);
    next_points_.erase(geom_id);
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
    copy->next_points_ = next_points_;
    const GilRelease release;
    copy->scene_ = scene_->on(device, &copy->cancel_build_);
    return copy;
}

}  // namespace morphray::python
