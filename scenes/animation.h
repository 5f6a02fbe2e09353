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
/// interpolated (files) or evaluated (procedural scenes). Implementations are immutable after
/// construction and may be used by several threads at once.
class Animation {
public:
    virtual ~Animation() = default;

    virtual const Topology& topology() const = 0;
    virtual double first_frame() const = 0;
    virtual double last_frame() const = 0;
    /// Frames a second: frame f is at f / fps() seconds; nothing if the animation knows no time.
    virtual std::optional<double> fps() const { return std::nullopt; }

    /// All animations of the file, in its order.
    virtual std::span<const NamedAnimation> animations() const { return {}; }

    /// Three numbers a triangle: corners with one number are smooth together. Empty: all flat.
    virtual std::span<const uvec3> smooth_corners() const { return {}; }

    /// The textures of the triangles, whose files have been found but not read. Null: none.
    virtual const SceneTextures* textures() const { return nullptr; }

    /// World space is the coordinates of the file minus this, so that floats have its digits.
    virtual Origin origin() const { return {}; }

    /// Writes the positions of all vertices, in world space. Frames are clamped to the range.
    /// Throws Error(kBadInput) for a frame that cannot be read.
    virtual void positions(double frame, std::span<vec3> out) const = 0;

    /// Bounds of the first frame's finite vertices that triangles use and that are not left out
    /// (PoseExtent::limit()); a point at the origin if there are none. Empty without vertices.
    virtual WorldBounds bounds() const = 0;

    /// Nothing for scenes that can be seen from outside.
    virtual std::optional<InsideView> inside_view() const { return std::nullopt; }

    /// Scenes of files are shown as objects: in the middle of the image, on a ground.
    virtual bool is_builtin() const { return false; }

    /// The scene's name in reports: the builtin's name, or the path as given.
    virtual const std::string& name() const = 0;

protected:
    /// bounds() from the positions of the first frame.
    /// `part_begins`: the first vertices of its parts, ascending from 0; empty: it is one.
    static WorldBounds reference_bounds(const Topology& topology, std::span<const vec3> first,
                                        std::span<const std::uint32_t> part_begins = {}) {
        const std::vector<IndexRange> used = used_vertices(topology);
        std::vector<WorldBounds> parts;
        for (std::size_t i = 0; i < part_begins.size(); ++i) {
            const std::uint32_t end =
                i + 1 < part_begins.size() ? part_begins[i + 1] : topology.vertex_count;
            PoseExtent part;
            for (auto range = std::ranges::upper_bound(used, part_begins[i], {}, &IndexRange::end);
                 range != used.end() && range->begin < end; ++range) {
                const std::uint32_t from = std::max(range->begin, part_begins[i]);
                part.add(first.subspan(from, std::min(range->end, end) - from));
            }
            parts.push_back(part.bounds(part.limit()));
        }
        const WorldBounds bounds = bounds_of_parts(PoseExtent(first, used), std::move(parts));
        return bounds.empty() && !first.empty() ? WorldBounds{{0, 0, 0}, {0, 0, 0}} : bounds;
    }
};

/// Opens `builtin:NAME[:TRIANGLES]`, a mesh file, a folder of them, a pattern such as
/// `frame_%04d.obj`, or a glTF file. Throws Error: kBadArgument, kBadInput, kLimit.
std::unique_ptr<Animation> open_scene(const std::string& spec,
                                      const AnimationOptions& options = {});

}  // namespace mray
