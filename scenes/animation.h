// A deforming scene: one topology, positions as a function of the frame; and how it is opened.
#pragma once

#include <algorithm>
#include <optional>

#include "common/base/errors.h"
#include "common/scene/mesh.h"
#include "common/scene/scene_space.h"

namespace mray {

struct AnimationOptions {
    /// Accept vertices that are not finite and leave out faces that cannot be read, with warnings.
    bool lenient = false;
    /// Interpolate the missing frames of a sequence, with a warning, instead of refusing it.
    bool skip_missing = false;
    /// A PC2 file with the positions of a mesh file's vertices; empty: none.
    std::string cache = {};
    /// The animation of a glTF file, by its name or its index; empty: the first.
    std::string animation = {};
    /// The frames that an animation of a glTF file has a second, above 0; nothing: kDefaultFps.
    std::optional<double> fps = {};
    /// Is told the size of a glTF scene before it takes memory; may throw Error(kLimit).
    std::function<void(std::uint64_t triangles, std::uint64_t vertices)> check_size = {};
    WarnFunction warn = {};
};

struct NamedAnimation {
    /// Empty: it has none.
    std::string name = {};
    bool is_shown = false;
};

/// Where to look from in a scene that is closed, in world space.
struct InsideView {
    std::array<double, 3> eye, target, light;
};

/// Frames are numbers in [first_frame(), last_frame()]; between whole numbers positions are
/// interpolated (files) or evaluated (procedural scenes). Immutable after construction, so that
/// several threads may use one at once.
class Animation {
public:
    virtual ~Animation() = default;

    const Topology& topology() const { return topology_; }
    double first_frame() const { return first_frame_; }
    double last_frame() const { return last_frame_; }
    /// Frames a second: frame f is at f / fps() seconds; nothing if the animation knows no time.
    std::optional<double> fps() const { return fps_; }

    /// All animations of the file, in its order.
    std::span<const NamedAnimation> animations() const { return animations_; }

    /// Three numbers a triangle: corners with one number are smooth together. Empty: all flat.
    std::span<const uvec3> smooth_corners() const { return smooth_corners_; }

    /// The textures of the triangles, whose files have been found but not read. Null: none.
    const SceneTextures* textures() const { return textures_.files.empty() ? nullptr : &textures_; }

    /// World space is the coordinates of the file minus this, so that floats have its digits.
    Origin origin() const { return origin_; }

    /// Writes the positions of all vertices, in world space. Frames are clamped to the range.
    /// Throws Error(kBadInput) for a frame that cannot be read.
    virtual void positions(double frame, std::span<vec3> out) const = 0;

    /// Bounds of the first frame's finite vertices that triangles use and that are not left out
    /// (PoseExtent::limit()); a point at the origin if there are none. Empty without vertices.
    WorldBounds bounds() const { return bounds_; }

    /// Nothing for scenes that can be seen from outside.
    std::optional<InsideView> inside_view() const { return inside_view_; }

    /// Scenes of files are shown as objects: in the middle of the image, on a ground.
    bool is_builtin() const { return is_builtin_; }

    /// The scene's name in reports: the builtin's name, or the path as given.
    const std::string& name() const { return name_; }

protected:
    explicit Animation(const std::string& name) : name_(name) {}

    /// Sets bounds() from the positions of the first frame.
    /// `part_begins`: the first vertices of its parts, ascending from 0; empty: it is one.
    void set_bounds(std::span<const vec3> first, std::span<const std::uint32_t> part_begins = {}) {
        const std::vector<IndexRange> used = used_vertices(topology_);
        std::vector<WorldBounds> parts;
        for (std::size_t i = 0; i < part_begins.size(); ++i) {
            const std::uint32_t end =
                i + 1 < part_begins.size() ? part_begins[i + 1] : topology_.vertex_count;
            PoseExtent part;
            for (auto range = std::ranges::upper_bound(used, part_begins[i], {}, &IndexRange::end);
                 range != used.end() && range->begin < end; ++range) {
                const std::uint32_t from = std::max(range->begin, part_begins[i]);
                part.add(first.subspan(from, std::min(range->end, end) - from));
            }
            parts.push_back(part.bounds(part.limit()));
        }
        bounds_ = bounds_of_parts(PoseExtent(first, used), std::move(parts));
        if (bounds_.empty() && !first.empty()) bounds_ = {{0, 0, 0}, {0, 0, 0}};
    }

    Topology topology_;
    double first_frame_ = 0;
    double last_frame_ = 0;
    std::optional<double> fps_;
    std::vector<NamedAnimation> animations_;
    std::span<const uvec3> smooth_corners_;
    SceneTextures textures_;
    Origin origin_;
    WorldBounds bounds_;
    std::optional<InsideView> inside_view_;
    bool is_builtin_ = false;

private:
    std::string name_;
};

/// Opens `builtin:NAME[:TRIANGLES]`, a mesh file, a folder of them, a pattern such as
/// `frame_%04d.obj`, or a glTF file. Throws Error: kBadArgument, kBadInput, kLimit.
std::unique_ptr<Animation> open_scene(const std::string& spec,
                                      const AnimationOptions& options = {});

}  // namespace mray
