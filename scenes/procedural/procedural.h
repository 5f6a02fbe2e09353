// Built-in deforming scenes: any size, no files, the same on every run. Each is in a file of its
// own.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <glm/vec3.hpp>

#include "scenes/animation.h"

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
    /// The result of Animation::inside_view().
    std::optional<InsideView> inside_view;
};

/// Rounds a position, once.
inline vec3 round_to_float(const glm::dvec3& p) {
    return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

struct ProceduralScene {
    const char* name;
    const char* description;
    std::uint32_t default_triangles;
    DeformingMesh (*make)(std::uint64_t triangles);
};

/// All built-in scenes, in the order in which `info` lists them.
std::span<const ProceduralScene> procedural_scenes();

/// A scene with about `triangles` triangles (0: its default; at least what the scene needs). Throws
/// Error(kBadArgument) for an unknown name, naming a similar one, and Error(kLimit) above 2^28.
std::unique_ptr<Animation> make_procedural(const std::string& name, std::uint64_t triangles = 0);

// The scenes, which kScenes in procedural.cpp describes. `triangles` is about how many triangles to
// make; a scene has at least as many as its shape needs.

DeformingMesh make_cloth(std::uint64_t triangles);
/// Boxes between the ends turn in proportion to their height.
DeformingMesh make_twist(std::uint64_t triangles);
/// The hills are at least half of the triangles.
DeformingMesh make_herd(std::uint64_t triangles);
/// The triangles change places at each whole frame, which degrades a refitted tree as fast as
/// possible.
DeformingMesh make_shuffle(std::uint64_t triangles);
DeformingMesh make_soup(std::uint64_t triangles);
/// One closed mesh, star-shaped around the origin, so that each ray from there must hit.
DeformingMesh make_spikes(std::uint64_t triangles);
DeformingMesh make_orbits(std::uint64_t triangles);
/// The balls of orbits jump at every third frame.
DeformingMesh make_teleport(std::uint64_t triangles);
/// x from -20 to 20, y from 0 to 9, z from -7 to 7.
DeformingMesh make_hall(std::uint64_t triangles);

}  // namespace mray
