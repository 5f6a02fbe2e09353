#include "app/view/engine.h"

#include <utility>

namespace mray::app {

Engine::Engine(const Options& options, const Clip& clip, const Messages& messages,
               std::function<void()> on_result)
    : options_(options),
      clip_(clip),
      messages_(messages),
      on_result_(std::move(on_result)),
      thread_([this] { run(); }) {}

Engine::~Engine() {
    {
        const std::scoped_lock lock(mutex_);
        stops_ = true;
        cancel_ = true;
    }
    wakes_.notify_one();
    thread_.join();
}

void Engine::post(ImageRequest request) {
    {
        const std::scoped_lock lock(mutex_);
        next_image_ = std::move(request);
        if (is_refining_) cancel_ = true;
    }
    wakes_.notify_one();
}

void Engine::probe(ProbeRequest request) {
    {
        const std::scoped_lock lock(mutex_);
        next_probe_ = std::move(request);
        if (is_refining_) cancel_ = true;
    }
    wakes_.notify_one();
}

std::unique_ptr<TracedImage> Engine::take() {
    const std::scoped_lock lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
    return std::move(image_);
}

std::optional<PixelProbe> Engine::take_probe() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(probe_, std::nullopt);
}

/// Waits for work. Returns false when the engine stops.
bool Engine::next(std::optional<ImageRequest>& image, std::optional<ProbeRequest>& probe) {
    std::unique_lock lock(mutex_);
    is_refining_ = false;
    wakes_.wait(lock, [&] { return stops_ || next_image_ || next_probe_; });
    if (stops_) return false;
    probe = std::exchange(next_probe_, std::nullopt);
    image = std::exchange(next_image_, std::nullopt);
    is_refining_ = image && image->is_refined();
    cancel_ = false;
    return true;
}

void Engine::run() {
    try {
        std::optional<ImageRequest> image;
        std::optional<ProbeRequest> probe;
        while (next(image, probe)) {
            if (probe) answer(*probe);
            if (image) trace(*image);
        }
    } catch (...) {
        const std::scoped_lock lock(mutex_);
        failure_ = std::current_exception();
    }
    on_result_();
}

TracedScene& Engine::scene(BackendChoice backend) {
    return scenes_.try_emplace(backend, options_, clip_, backend, messages_, stops_, builds_)
        .first->second;
}

void Engine::trace(const ImageRequest& request) {
    auto image = std::make_unique<TracedImage>();
    try {
        for (const BackendChoice backend : request.backends)
            image->panes.push_back(scene(backend).trace(request, cancel_));
        if (request.box_depth >= 0) {
            const auto depth = static_cast<std::uint32_t>(request.box_depth);
            image->boxes = scene(request.backends.front()).tree_boxes(depth);
        }
    } catch (const Error& error) {
        if (error.kind() == ErrorKind::kCancelled) {
            // If a probe was the reason, the image is still wanted.
            const std::scoped_lock lock(mutex_);
            if (!next_image_) next_image_ = request;
            return;
        }
        if (!has_traced_ || error.kind() == ErrorKind::kDeviceLost) throw;
        image->panes.clear();
        image->error = error.what();
        // A scene that failed may be of no use any more.
        for (const BackendChoice backend : request.backends) scenes_.erase(backend);
    }
    has_traced_ = true;
    image->request = request;
    {
        const std::scoped_lock lock(mutex_);
        image_ = std::move(image);
    }
    on_result_();
}

void Engine::answer(const ProbeRequest& request) {
    PixelProbe probe{request, {}};
    try {
        for (const BackendChoice backend : request.image.backends)
            probe.hits.push_back(scene(backend).probe(request.image, request.pixel));
    } catch (const Error& error) {
        if (error.kind() == ErrorKind::kDeviceLost) throw;
        // The image of the same request says what is wrong.
        return;
    }
    {
        const std::scoped_lock lock(mutex_);
        probe_ = std::move(probe);
    }
    on_result_();
}

}  // namespace mray::app
