#include "app/clip/posed_scene.h"

#include <fmt/format.h>

#include "app/clip/clip_scene.h"
#include "app/clip/frames.h"
#include "app/terminal/failure.h"
#include "app/terminal/progress.h"
#include "common/scene/mesh.h"
#include "common/text/text_parts.h"

namespace mray::app {

PosedScene::PosedScene(const SourceOptions& source, const BackendOptions& backend,
                       const std::optional<double>& frame, const Messages& messages)
    : frames_(open_clip(source, messages)), scene_(pose(backend, frame, messages)) {}

morphray::Scene PosedScene::pose(const BackendOptions& backend, const std::optional<double>& frame,
                                 const Messages& messages) {
    const Clip& clip = frames_.clip();
    frame_ = select_frame(frame, std::nullopt, clip);
    if (const std::uint64_t bad =
            count_degenerate(topology(), frames_.positions(frame_)).not_finite) {
        messages.warn({escape(clip.name()),
                       fmt::format("{} of {} triangles are not finite; they are never hit", bad,
                                   topology().triangles.size())});
    }
    positions_.resize(topology().vertex_count);
    clip.positions(frame_, positions_);
    const morphray::Device device = open_device(backend, messages);
    const Progress progress("building the tree", 0, messages);
    return call_library([&] {
        return morphray::Scene::build(mesh_of(topology(), positions_), device,
                                      {.bounds = bounds_of(clip),
                                       .update = morphray::Refit{},
                                       .cancel = &interrupt_flag(),
                                       .done = &step_done()});
    });
}

}  // namespace mray::app
