#include "app/view/engine.h"

#include "app/animation/devices.h"

namespace mray::app {

DifferenceImage difference_of(const TracedPane& first, const TracedPane& second) {
    constexpr std::uint32_t kEqual = 0xFF000000u;
    constexpr std::uint32_t kDifferent = 0xFFFFFFFFu;
    DifferenceImage image;
    image.pixels.resize(first.pixels.size());
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const bool differs = first.pixels[i] != second.pixels[i];
        image.different += differs ? 1 : 0;
        image.pixels[i] = differs ? kDifferent : kEqual;
    }
    return image;
}

std::string pixel_text(const PixelProbe& probe) {
    std::string text = fmt::format("pixel {},{}, frame {}\n", probe.request.pixel.x,
                                   probe.request.pixel.y, probe.request.image.frame);
    for (std::size_t i = 0; i < probe.hits.size(); ++i) {
        const morphray::Hit& hit = probe.hits[i];
        text += probe.devices[i] + "\n";
        if (!hit) {
            text += "  miss\n";
            continue;
        }
        // The ground is the scene's second mesh.
        text += hit.geom_id == 0 ? fmt::format("  triangle {}\n", hit.prim_id) : "  ground\n";
        for (const auto& [name, x] :
             {std::pair("t", hit.t), std::pair("u", hit.u), std::pair("v", hit.v)})
            text += fmt::format("  {} {:<17} {:.9g}\n", name, hex_text(x), x);
    }
    if (probe.hits.size() < 2) return text;
    return text + (probe.hits[0] == probe.hits[1] ? "equal bit by bit\n" : "DIFFERENT\n");
}

Engine::Engine(const ImageOptions& options, const Animation& animation, const Messages& messages,
               std::function<void()> on_result)
    : options_(options),
      animation_(animation),
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

template <class Request>
void Engine::ask(std::optional<Request>& next, Request request) {
    {
        const std::scoped_lock lock(mutex_);
        next = std::move(request);
        if (is_refining_) cancel_ = true;
    }
    wakes_.notify_one();
}

void Engine::post(ImageRequest request) { ask(next_image_, std::move(request)); }
void Engine::probe(ProbeRequest request) { ask(next_probe_, std::move(request)); }

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

/// A change of the policy builds a new scene. There is one with the ground and one without.
Engine::BackendScene& Engine::follow(const ImageRequest& request, BackendChoice backend) {
    const bool ground = has_ground(options_.ground, request.view, animation_);
    BackendScene& traced = scenes_[{backend, ground}];
    const bool is_new = !traced.scene || traced.update != request.update;
    if (is_new) {
        ImageOptions options = options_;
        options.backend.choice = backend;
        options.tree.update = request.update;
        options.tree.record_cost_ratio = true;
        // Whatever is shown first, the scene has its textures.
        options.view.shading = morphray::Shading::lit;
        options.ground = ground;
        // --build-at is for the first tree; a change of settings builds where one is.
        if (traced.scene) options.tree.build_at.reset();
        traced.scene =
            std::make_unique<AnimationScene>(open_device(options.backend, messages_), options,
                                             animation_, request.frame, messages_, stops_);
        traced.update = request.update;
    }
    if (is_new || traced.frame != request.frame) traced.scene->advance(request.frame);
    traced.frame = request.frame;
    return traced;
}

TracedPane Engine::trace(const ImageRequest& request, BackendChoice backend) {
    BackendScene& traced = follow(request, backend);
    morphray::View view = request.view;
    view.hits = false;
    view.cancel = &cancel_;
    traced.scene->render(view, traced.image);
    return {.device = traced.scene->scene().device().description(),
            .width = traced.image.width,
            .height = traced.image.height,
            .pixels = std::move(traced.image.pixels),
            .rays = traced.image.ray_count,
            .deform_ms = traced.scene->times().deform_ms,
            .trace_ms = traced.image.trace_ms,
            .update = traced.scene->update()};
}

void Engine::trace(const ImageRequest& request) {
    auto image = std::make_unique<TracedImage>();
    try {
        for (const BackendChoice backend : request.backends)
            image->panes.push_back(trace(request, backend));
        if (request.box_depth >= 0) {
            const auto depth = static_cast<std::uint32_t>(request.box_depth);
            const AnimationScene& scene = *follow(request, request.backends.front()).scene;
            image->boxes = call_library([&] { return scene.scene().tree_boxes(depth); });
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
        scenes_.clear();
    }
    has_traced_ = true;
    image->request = request;
    image->scale = scale_text(request.view, animation_);
    {
        const std::scoped_lock lock(mutex_);
        image_ = std::move(image);
    }
    on_result_();
}

void Engine::answer(const ProbeRequest& request) {
    PixelProbe probe{request, {}, {}};
    try {
        morphray::View view = request.image.view;
        view.shading = morphray::Shading::plain;
        view.rays = morphray::Rays::primary;
        view.samples = 1;
        view.ao_count = 1;
        view.cancel = &interrupt_flag();
        for (const BackendChoice backend : request.image.backends) {
            BackendScene& traced = follow(request.image, backend);
            morphray::Image image;
            traced.scene->render(view, image);
            probe.devices.push_back(traced.scene->scene().device().description());
            probe.hits.push_back(
                image.hits[std::size_t{request.pixel.y} * image.width + request.pixel.x]);
        }
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
