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

std::string pixel_text(const TracedImage& image) {
    const Pixel& pixel = *image.request.pixel;
    std::string text =
        fmt::format("pixel {},{}, frame {}\n", pixel.x, pixel.y, image.request.frame);
    for (const TracedPane& pane : image.panes) {
        const morphray::Hit& hit = pane.hit;
        text += pane.device + "\n";
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
    if (image.panes.size() < 2) return text;
    return text + (image.panes[0].hit == image.panes[1].hit ? "equal bit by bit\n" : "DIFFERENT\n");
}

Engine::Engine(const Options& options, const Animation& animation, const Messages& messages,
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

void Engine::post(ImageRequest request) {
    {
        const std::scoped_lock lock(mutex_);
        next_ = std::move(request);
        if (is_refining_) cancel_ = true;
    }
    wakes_.notify_one();
}

std::unique_ptr<TracedImage> Engine::take() {
    const std::scoped_lock lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
    return std::move(image_);
}

/// Waits for a request. Returns nothing when the engine stops.
std::optional<ImageRequest> Engine::next() {
    std::unique_lock lock(mutex_);
    is_refining_ = false;
    wakes_.wait(lock, [&] { return stops_ || next_; });
    if (stops_) return std::nullopt;
    is_refining_ = next_->is_refined();
    cancel_ = false;
    return std::exchange(next_, std::nullopt);
}

void Engine::run() {
    try {
        while (const std::optional<ImageRequest> request = next()) trace(*request);
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
        Options options = options_;
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
    view.hits = request.pixel.has_value();
    view.cancel = &cancel_;
    if (request.pixel) {
        view.shading = morphray::Shading::plain;
        view.rays = morphray::Rays::primary;
        view.samples = 1;
        view.ao_count = 1;
    }
    traced.scene->render(view, traced.image);
    const std::size_t index =
        request.pixel ? std::size_t{request.pixel->y} * view.width + request.pixel->x : 0;
    return {.device = traced.scene->scene().device().description(),
            .pixels = std::move(traced.image.pixels),
            .rays = traced.image.ray_count,
            .deform_ms = traced.scene->deform_ms(),
            .trace_ms = traced.image.trace_ms,
            .update = traced.scene->update(),
            .hit = request.pixel ? traced.image.hits[index] : morphray::Hit{}};
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
        if (error.kind() == ErrorKind::kCancelled) return;
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

}  // namespace mray::app
