// A deforming scene: one topology, vertex positions as a function of the frame.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "common/mesh.h"
#include "common/user_bounds.h"
#include "common/warning.h"

namespace morphray {

/// Frames are numbers in [first_frame(), last_frame()]; between whole numbers positions are
/// interpolated (files) or evaluated (procedural scenes). Implementations are immutable after
/// construction and may be used by several threads at once.
class Clip {
public:
    virtual ~Clip() = default;

    virtual const Topology& topology() const = 0;
    virtual double first_frame() const = 0;
    virtual double last_frame() const = 0;

    /// Writes the vertex positions of a frame, in the user's units; out has topology().vertex_count
    /// entries. A frame outside the range is clamped to it. Throws Error(kBadInput) with the frame
    /// when this frame could not be read or is not finite although the clip was opened strictly.
    virtual void positions(double frame, std::span<vec3> out) const = 0;

    /// Whether positions() of this frame does not throw.
    virtual bool usable(double) const { return true; }
    /// What makes frames unusable, the first of it; nothing if all are usable.
    virtual std::optional<Warning> damage() const { return std::nullopt; }

    /// Bounds of all finite vertices over the whole clip, whatever frames are asked for.
    virtual UserBounds bounds() const = 0;

    /// What to call the scene in reports: the builtin's name or the path as given.
    virtual const std::string& name() const = 0;
};

}  // namespace morphray
