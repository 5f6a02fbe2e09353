// Built-in deforming scenes: any size, the same on every run. Each is in a file of its own.
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
    /// Writes out[begin..end), a pure function of frame and vertex. Many threads call it at once.
    std::function<void(double frame, VertexRange range, std::span<vec3> out)> move;
    /// The result of Animation::inside_view().
    std::optional<InsideView> inside_view;
};

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

/// 0 triangles: the default. Throws Error(kBadArgument) for an unknown name, and kLimit.
std::unique_ptr<Animation> make_procedural(const std::string& name, std::uint64_t triangles = 0);

// `triangles` is about how many to make; a scene has at least as many as its shape needs.

DeformingMesh make_cloth(std::uint64_t triangles);
/// Boxes between the ends turn in proportion to their height.
DeformingMesh make_twist(std::uint64_t triangles);
/// The hills are at least half of the triangles.
DeformingMesh make_herd(std::uint64_t triangles);
/// Triangles change places at each whole frame, which degrades a refitted tree fastest.
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
