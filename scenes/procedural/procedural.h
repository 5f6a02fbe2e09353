// Built-in deforming scenes: any size, the same on every run.
#pragma once

#include <memory>
#include <string>

#include "scenes/procedural/surfaces.h"

namespace mray {

struct ProceduralScene {
    const char* name;
    const char* description;
    std::uint32_t default_triangles;
    /// With about as many triangles as asked for, and at least as many as its shape needs.
    DeformingMesh (*make)(std::uint64_t triangles);
};

/// All built-in scenes, in the order in which `info` lists them.
std::span<const ProceduralScene> procedural_scenes();

/// 0 triangles: the default. Throws Error(kBadArgument) for an unknown name, and kLimit.
std::unique_ptr<Animation> make_procedural(const std::string& name, std::uint64_t triangles = 0);

}  // namespace mray
