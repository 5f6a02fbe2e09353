#include "app/clip/posed_scene.h"

#include <fmt/format.h>

#include "app/backends/backends.h"
#include "app/base/library_calls.h"
#include "app/clip/clip_scene.h"
#include "app/clip/frames.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/scene/degenerate_count.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

BackendOptions backend_of(const Options& options) {
    BackendOptions backend = options.backend;
    const bool device = !backend.device.empty() || backend.validate;
    if (!backend.choice_given && !device) backend.choice = BackendChoice::kCpu;
    return backend;
}

}  // namespace

PosedScene::PosedScene(const Options& options, const Messages& messages)
    : frames_(open_frames(options, messages)), scene_(pose(options, messages)) {}

morphray::Scene PosedScene::pose(const Options& options, const Messages& messages) {
    const Clip& clip = frames_.clip();
    frame_ = select_frames(options, clip, DefaultFrames::kFirst).front();
    if (const std::uint64_t bad =
            count_degenerate(topology(), frames_.positions(frame_)).not_finite) {
        messages.warn({shown(options.scene),
                       fmt::format("{} of {} triangles are not finite; they are never hit", bad,
                                   topology().triangles.size())});
    }
    positions_.resize(topology().vertex_count);
    clip.positions(frame_, positions_);
    const morphray::Device device = open_device(backend_of(options), messages);
    const Progress progress("building the tree", "", 0, progress_mode(options));
    return call_library([&] {
        return morphray::Scene::build(mesh_of(topology(), positions_), device,
                                      {.bounds = bounds_of(clip),
                                       .update = morphray::Refit{},
                                       .cancel = &interrupt_flag(),
                                       .done = &step_done()});
    });
}

}  // namespace mray::app
