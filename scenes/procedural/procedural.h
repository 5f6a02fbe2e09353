// Built-in deforming scenes: any size, no files, the same on every run.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "scenes/clip.h"

namespace mray {

struct DeformingMesh;

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
std::unique_ptr<Clip> make_procedural(const std::string& name, std::uint64_t triangles = 0);

}  // namespace mray
