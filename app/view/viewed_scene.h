// The scene that the viewer shows.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "app/base/options.h"
#include "app/terminal/messages.h"
#include "app/view/engine.h"
#include "app/view/view_state.h"
#include "scenes/clip.h"

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
/// with_render_defaults(). Warnings go to `messages`, which must outlive the scene. Throws Error.
std::unique_ptr<ViewedScene> open_viewed_scene(const Options& options, const Messages& messages,
                                               std::function<void()> on_result);

/// "building the tree, 2.1 M triangles".
std::string building_text(const Clip& clip);

}  // namespace mray::app
