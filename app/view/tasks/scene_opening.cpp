#include "app/view/tasks/scene_opening.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "app/backends/backends.h"
#include "app/base/numbers.h"
#include "app/clip/clip_scene.h"
#include "app/clip/frames.h"
#include "app/terminal/progress.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

/// Resolves options.backend.choice: kAuto needs a look at the devices.
BackendChoice chosen_backend(const Options& options, const Messages& messages) {
    if (options.comparison != Comparison::kOff) return BackendChoice::kCpu;
    const morphray::Device device = open_device(options.backend, messages);
    if (device.name() == "vulkan") return BackendChoice::kVulkan;
    return device.name() == "brute" ? BackendChoice::kBrute : BackendChoice::kCpu;
}

/// Whether an argument that decides the image is about all scenes, and not about one.
bool is_of_all_scenes(const std::string& option) { return option == "--build"; }

}  // namespace

ViewedScene::ViewedScene(const Options& given, std::unique_ptr<Clip> opened, const ViewState& first,
                         const Messages& messages, std::function<void()> on_result)
    : options(given),
      clip(std::move(opened)),
      first_state(first),
      engine(options, *clip, messages, std::move(on_result)) {}

std::unique_ptr<ViewedScene> open_viewed_scene(const Options& options, const Messages& messages,
                                               std::function<void()> on_result,
                                               const std::atomic<bool>& cancel) {
    std::unique_ptr<Clip> clip = open_clip(options, messages, cancel);
    const double frame = select_frame(options, *clip);
    warn_of_damage(options, *clip, {&frame, 1}, messages);
    const ViewState state = initial_state(options, *clip, chosen_backend(options, messages), frame);
    return std::make_unique<ViewedScene>(options, std::move(clip), state, messages,
                                         std::move(on_result));
}

Options options_for(const std::string& scene, const Options& shown) {
    Options options = shown;
    const Options none;
    options.scene = scene;
    options.frame_given = false;
    options.time.clear();
    options.fps = none.fps;
    options.animation.clear();
    options.missing = none.missing;
    options.cache.clear();
    options.index = shown.index == "none" ? shown.index : none.index;
    options.bounds = none.bounds;
    options.view.eye = none.view.eye;
    options.view.target = none.view.target;
    options.view.light = none.view.light;
    options.view.ao_distance = none.view.ao_distance;
    options.tree.build_at = none.tree.build_at;
    options.view_arguments.clear();
    for (std::size_t i = 0; i + 1 < shown.view_arguments.size(); i += 2) {
        if (!is_of_all_scenes(shown.view_arguments[i])) continue;
        options.view_arguments.insert(options.view_arguments.end(),
                                      {shown.view_arguments[i], shown.view_arguments[i + 1]});
    }
    return options;
}

ViewState continued_state(const ViewState& first, const ViewState& shown) {
    ViewState state = shown;
    state.playback = first.playback;
    state.playback.playing = shown.playback.playing;
    state.playback.loop = shown.playback.loop;
    state.playback.frames_a_second = shown.playback.frames_a_second;
    state.camera = first.camera;
    state.light = first.light;
    state.ao_distance = first.ao_distance;
    state.edit = {};
    state.shakes = false;
    return state;
}

SceneOpening::SceneOpening(const std::string& scene, const Options& shown, const ViewState& state,
                           const Messages& messages, std::function<void()> on_result)
    : name_(scene), shown_(state) {
    Options options = options_for(scene, shown);
    options.backend.choice = state.backend;
    options.comparison = state.comparison;
    step_done() = 0;
    opened_ = std::async(std::launch::async, [this, options, &messages, on_result] {
        return open_viewed_scene(options, messages, on_result, cancel_);
    });
}

SceneOpening::~SceneOpening() {
    const EndOfGrace end;
    cancel_ = true;
    if (opened_.valid()) opened_.wait();
}

std::unique_ptr<ViewedScene> SceneOpening::take() {
    if (!scene_) {
        if (opened_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return nullptr;
        scene_ = opened_.get();
        scene_->engine.post(request_of(continued_state(scene_->first_state, shown_), 0));
    }
    first_image_ = scene_->engine.take();
    return first_image_ ? std::move(scene_) : nullptr;
}

std::string SceneOpening::activity() const {
    if (builds()) return building_text(*scene_->clip);
    return "opening " + shown(name_);
}

std::string building_text(const Clip& clip) {
    return fmt::format("building the tree, {} triangles",
                       brief_count(static_cast<double>(clip.topology().triangles.size())));
}

}  // namespace mray::app
