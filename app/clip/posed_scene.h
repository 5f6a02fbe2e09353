// A scene of the library at one frame of a clip, for the rays or points of a file.
#pragma once

#include <optional>
#include <vector>

#include "app/base/options.h"
#include "app/terminal/messages.h"
#include "morphray/scene.hpp"
#include "scenes/scene_frames.h"

namespace mray::app {

class PosedScene {
public:
    /// Opens the scene at this frame, or at its first. Warns of triangles that are not finite.
    /// Throws Error.
    PosedScene(const SourceOptions& source, const BackendOptions& backend,
               const std::optional<double>& frame, const Messages& messages);
    PosedScene(const PosedScene&) = delete;

    const SceneSpace& space() const { return frames_.space(); }
    const morphray::Scene& scene() const { return scene_; }
    const Topology& topology() const { return frames_.clip().topology(); }
    double frame() const { return frame_; }
    const std::string& name() const { return frames_.clip().name(); }

private:
    /// Sets frame_ and positions_, too.
    morphray::Scene pose(const BackendOptions& backend, const std::optional<double>& frame,
                         const Messages& messages);

    SceneFrames frames_;
    double frame_ = 0;
    /// In world space; the scene borrows them.
    std::vector<vec3> positions_;
    morphray::Scene scene_;
};

}  // namespace mray::app
