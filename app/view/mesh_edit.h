// Changes that the viewer makes to a clip: vertices that are pulled, a mesh that is shaken.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "clips/clip.h"

namespace mray::app {

/// A vertex that was pulled, and with it those around it.
struct Pull {
    std::uint32_t vertex = 0;
    /// In world space.
    vec3 offset = {0, 0, 0};
    /// Where vertices begin to stay where they are, in world space.
    float radius = 0;
    bool operator==(const Pull&) const = default;
};

struct MeshEdit {
    std::vector<Pull> pulls;
    /// How far vertices are thrown at most, as a part of the diagonal of the clip's bounds.
    float shake = 0;
    /// Each number throws them differently.
    std::uint32_t shake_seed = 0;

    bool empty() const { return pulls.empty() && shake == 0; }
    bool operator==(const MeshEdit&) const = default;
};

/// Moves the positions of a frame in world space; `diagonal` is that of the clip's bounds.
/// Positions that are not finite stay so.
void apply(const MeshEdit& edit, float diagonal, std::span<vec3> positions);

/// A clip with an edit. The clip must outlive it. edit() and positions() must not be called at the
/// same time.
class EditedClip final : public Clip {
public:
    explicit EditedClip(const Clip& clip);

    void set(MeshEdit edit) { edit_ = std::move(edit); }

    const Topology& topology() const override { return clip_.topology(); }
    double first_frame() const override { return clip_.first_frame(); }
    double last_frame() const override { return clip_.last_frame(); }
    const SceneTextures* textures() const override { return clip_.textures(); }
    std::span<const uvec3> smooth_corners() const override { return clip_.smooth_corners(); }
    void positions(double frame, std::span<vec3> out) const override;
    bool usable(double frame) const override { return clip_.usable(frame); }
    std::optional<Warning> damage() const override { return clip_.damage(); }
    WorldBounds bounds() const override { return clip_.bounds(); }
    const std::string& name() const override { return clip_.name(); }

private:
    const Clip& clip_;
    float diagonal_;
    MeshEdit edit_;
};

/// The length of the diagonal of bounds; 0 for empty ones.
double diagonal_of(const WorldBounds& bounds);

}  // namespace mray::app
