// An animation as a scene of the library.
#pragma once

#include <future>

#include "app/base/messages.h"
#include "app/base/options.h"
#include "common/scene/camera_setup.h"
#include "morphray/scene.hpp"

namespace mray::app {

/// Keeps the library's scene at one frame of an animation. Members throw Error.
class AnimationScene {
public:
    /// Builds the tree at options.tree.build_at, or else at first_frame. A lit scene has textures,
    /// and a ground if the options say so. The animation must outlive it, and so must `cancel`,
    /// which ends the building of trees by Error(kCancelled).
    AnimationScene(const morphray::Device& device, const Options& options,
                   const Animation& animation, double first_frame, const Messages& messages,
                   const std::atomic<bool>& cancel = interrupt_flag());
    AnimationScene(const AnimationScene&) = delete;

    /// Begins to read the positions of the next advance() in a thread, undefined until then.
    void prepare(double frame);
    /// Deforms the mesh and updates the tree, unless the first call is for the frame built.
    void advance(double frame);
    /// Deforms the mesh, but leaves the tree as it is: only engine.h knows these positions. Returns
    /// the milliseconds.
    double deform(double frame);
    /// Traces a view in world space.
    void render(const morphray::View& view, morphray::Image& image);

    const morphray::Scene& scene() const { return *scene_; }
    /// The last build or advance(); after render() with the refit that a device ran with the trace.
    const morphray::Update& update() const { return update_; }
    /// The milliseconds that the positions of the frame took.
    double deform_ms() const { return deform_ms_ + update_.read_ms; }
    /// The vertices of the mesh at the frame, in world space.
    std::span<const vec3> positions() const { return positions_; }
    /// The backend that refitted the tree of this frame, "cpu" or "vulkan"; empty after a build.
    std::string refitted_on() const;

private:
    std::vector<morphray::MeshView> meshes(std::span<const morphray::TextureView> textures) const;
    /// Once, if vertices are too far or triangles too small to be hit.
    void warn_of_left_out();
    /// Makes the positions of a frame, and the ground below them. Returns the milliseconds.
    double place(double frame);

    const Animation& animation_;
    const Messages& messages_;
    bool has_warned_ = false;
    std::vector<IndexRange> used_;
    std::vector<vec3> positions_;
    /// The corners of the ground; empty without one.
    std::vector<vec3> ground_;
    Point up_;
    std::optional<morphray::Scene> scene_;
    double current_ = 0;
    bool is_fresh_ = true;
    double deform_ms_ = 0;
    morphray::Update update_;
    std::optional<double> prepared_;
    /// Writes to positions_.
    std::future<double> reading_;
};

/// Says that vertices are left out since they are too far (PoseExtent::limit()).
Warning warning_of_far(const Animation& animation, std::uint64_t vertices);

/// A view in the coordinates of the file as one in world space, with an eye, a target and a light.
/// Unless an eye or a target is given, files are seen as objects (frame_object()) and closed scenes
/// from their inside_view(). Throws Error for a view that is impossible.
morphray::View world_view(morphray::View view, const Animation& animation);

/// The values of the colours of depths, without a line's end; empty for other shadings.
std::string scale_text(const morphray::View& world, const Animation& animation);

/// As the option says, or else for a lit file whose ground the eye is above.
bool has_ground(const std::optional<bool>& option, const morphray::View& world,
                const Animation& animation);

struct PosedAnimation {
    std::unique_ptr<Animation> animation;
    std::unique_ptr<AnimationScene> scene;
};

/// Opens the scene at its frame. Warns of triangles that are not finite.
PosedAnimation pose_animation(const Options& options, const Messages& messages);

}  // namespace mray::app
