#include "app/view/traced_scene.h"

#include "app/base/library_calls.h"
#include "app/terminal/progress.h"

namespace mray::app {
namespace {

/// Says that a tree is built, as long as it lives.
class Building {
public:
    explicit Building(std::atomic<bool>& builds) : builds_(builds) {
        step_done() = 0;
        builds_ = true;
    }
    ~Building() {
        builds_ = false;
        step_done() = 0;
    }
    Building(const Building&) = delete;
    Building& operator=(const Building&) = delete;

private:
    std::atomic<bool>& builds_;
};

}  // namespace

TracedScene::TracedScene(const Options& options, const Clip& clip, BackendChoice backend,
                         const Messages& messages, const std::atomic<bool>& stops,
                         std::atomic<bool>& builds)
    : options_(options),
      clip_(clip),
      backend_(backend),
      messages_(messages),
      stops_(stops),
      builds_(builds) {
    options_.backend.choice = backend;
    options_.tree.update_config.record_cost_ratio = true;
    // Whatever is shown first, the scene has its textures.
    options_.shading.shading = morphray::Shading::lit;
}

/// Brings the scene to the request's frame. Returns whether an update ran.
bool TracedScene::follow(const ImageRequest& request) {
    const bool is_same = scene_ && settings_ == request.scene;
    if (is_same && frame_ == request.frame) return false;
    if (!is_same) {
        const bool is_first = !scene_;
        options_.tree.update = request.scene.update;
        options_.shading.ground = request.scene.ground;
        // --build-at is for the first tree; a change of settings builds where one is.
        if (!is_first) options_.tree.build_at.reset();
        const Building building(builds_);
        scene_.emplace(options_, clip_, request.frame, messages_, stops_);
        tree_ = {options_.tree.build_at.value_or(request.frame), true};
    }
    scene_->advance(request.frame);
    settings_ = request.scene;
    frame_ = request.frame;
    note_tree(request.frame);
    return true;
}

void TracedScene::note_tree(double frame) {
    switch (scene_->update().step) {
        case morphray::Step::rebuild:
            tree_ = {frame, true};
            break;
        case morphray::Step::restructure:
        case morphray::Step::swap:
            tree_.is_refitted = false;
            break;
        default:
            break;
    }
}

TracedPane TracedScene::trace(const ImageRequest& request, const std::atomic<bool>& cancel) {
    TracedPane pane;
    pane.backend = backend_;
    pane.has_update = follow(request);
    ShadingOptions shading;
    shading.shading = request.shading;
    shading.samples = request.samples;
    shading.flat = request.flat;
    morphray::Image& image = image_;
    scene_->render_pixels(request.view, shading, cancel, image);
    const FrameTimes times = scene_->times();
    pane.device = scene_->scene().device().description();
    pane.width = image.width;
    pane.height = image.height;
    pane.pixels = std::move(image.pixels);
    pane.rays = image.ray_count;
    pane.deform_ms = times.deform_ms;
    pane.update_ms = scene_->update().milliseconds();
    pane.trace_ms = image.trace_ms - image.shade_ms;
    pane.shade_ms = image.shade_ms;
    pane.update = scene_->update();
    pane.tree = tree_;
    return pane;
}

TracedScene::PixelHit TracedScene::probe(const ImageRequest& request, Pixel pixel) {
    follow(request);
    ShadingOptions plain;
    plain.shading = morphray::Shading::plain;
    ViewSpec view = request.view;
    view.rays = kRaysPrimary;
    view.ao_count = 1;
    morphray::Image image;
    scene_->render(view, plain, image);
    PixelHit found;
    found.hit = image.hits[std::size_t{pixel.y} * image.width + pixel.x];
    // The ground is no mesh of the clip.
    if (!found.hit || found.hit.geom_id != 0) return found;
    found.vertices = clip_.topology().triangles[found.hit.prim_id];
    for (int i = 0; i < 3; ++i) found.corners[i] = scene_->positions()[found.vertices[i]];
    return found;
}

std::vector<morphray::Box> TracedScene::tree_boxes(std::uint32_t depth) const {
    return call_library([&] { return scene_->scene().tree_boxes(depth); });
}

}  // namespace mray::app
