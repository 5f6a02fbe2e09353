// The parts of a built-in scene, and a clip made from them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <glm/vec3.hpp>

#include "scenes/clip.h"

namespace mray {

/// Vertices [begin, end).
struct VertexRange {
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
};

struct DeformingMesh {
    Topology topology;
    /// Frames are 0 to this whole number.
    double last_frame = 24;
    /// Writes out[begin..end) for a frame in [0, last_frame]: a pure function of the frame and the
    /// vertex, computed in double and rounded once. Called by many threads at once on parts.
    std::function<void(double frame, VertexRange range, std::span<vec3> out)> move;
    /// Triangles [0, static_triangle_count) never move.
    std::uint32_t static_triangle_count = 0;
    /// The result of Clip::inside_view().
    std::optional<InsideView> inside_view;
};

/// The clip of a scene.
std::unique_ptr<Clip> make_clip(std::string name, DeformingMesh mesh);

/// Rounds a position, once.
inline vec3 round_to_float(const glm::dvec3& p) {
    return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

}  // namespace mray
