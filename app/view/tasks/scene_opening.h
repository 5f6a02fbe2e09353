// Scenes that the viewer opens, at its start and while it shows another one.
#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <string>

#include "app/base/options.h"
#include "app/terminal/messages.h"
#include "app/view/engine.h"
#include "app/view/view_state.h"
#include "clips/clip.h"

namespace mray::app {

/// A scene with the engine that traces it.
struct ViewedScene {
    /// As those of Engine; the clip is that of the options, and `first_state` the view of them.
    ViewedScene(const Options& options, std::unique_ptr<Clip> clip, const ViewState& first_state,
                const Messages& messages, std::function<void()> on_result);

    Options options;
    std::unique_ptr<Clip> clip;
    ViewState first_state;
    Engine engine;
};

/// Opens options.scene, which may take long; nothing is traced yet. The options are those of
/// with_render_defaults(). Warnings go to `messages`, which must outlive the scene. Throws Error,
/// kCancelled soon after `cancel` becomes true.
std::unique_ptr<ViewedScene> open_viewed_scene(const Options& options, const Messages& messages,
                                               std::function<void()> on_result,
                                               const std::atomic<bool>& cancel);

/// The options to show another scene with: those of the program and of images stay, and those that
/// belong to a scene, such as its frame, its cache and the camera, are left out.
Options options_for(const std::string& scene, const Options& shown);

/// The first state of another scene, shown as `shown` is: shading, backends, tree and speed; but
/// from its own first camera, without edits.
ViewState continued_state(const ViewState& first, const ViewState& shown);

/// Opens another scene, and traces its first image, in threads of its own. Members are called by
/// one thread, and never wait.
class SceneOpening {
public:
    /// `shown` and `state` are those of the scene that is shown meanwhile; on_result goes to the
    /// engine of the new one.
    SceneOpening(const std::string& scene, const Options& shown, const ViewState& state,
                 const Messages& messages, std::function<void()> on_result);
    /// Cancels, and waits for the threads. After a signal the process may end before that.
    ~SceneOpening();
    SceneOpening(const SceneOpening&) = delete;
    SceneOpening& operator=(const SceneOpening&) = delete;

    /// The scene as soon as its first image is there, which is in first_image(); null before.
    /// Throws what is wrong with the scene, and is then of no use any more.
    std::unique_ptr<ViewedScene> take();
    std::unique_ptr<TracedImage> first_image() { return std::move(first_image_); }
    /// The name as it was given.
    const std::string& name() const { return name_; }
    /// Whether its tree is built, which says how far it is to step_done().
    bool builds() const { return scene_ && scene_->engine.builds(); }
    /// "opening NAME", or the tree that is built, without how far that is.
    std::string activity() const;

private:
    std::string name_;
    ViewState shown_;
    std::atomic<bool> cancel_ = false;
    std::unique_ptr<ViewedScene> scene_;
    std::unique_ptr<TracedImage> first_image_;
    std::future<std::unique_ptr<ViewedScene>> opened_;
};

/// "building the tree, 2.1 M triangles".
std::string building_text(const Clip& clip);

}  // namespace mray::app
