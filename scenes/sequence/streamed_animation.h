// Animations whose keyframes are read when needed, from mesh files or any other source.
#pragma once

#include "scenes/animation.h"
#include "scenes/mesh/mesh_file.h"
#include "scenes/sequence/file_patterns.h"

namespace mray {

struct FirstMesh {
    Topology topology;
    /// As Animation::smooth_corners(), but empty if the file has no normals.
    std::vector<uvec3> smooth;
    SceneTextures textures;
    Polygons faces;
    Origin origin;
    /// Of keyframe 0, or empty.
    std::vector<vec3> positions;
};

/// Reads the first file of an animation, by the format of its name. Throws as open_keyframes().
FirstMesh read_first_mesh(const std::filesystem::path& path, const AnimationOptions& options);

/// Threads may share them.
struct Keyframes {
    /// The frame of each; they increase.
    std::vector<double> frames = {};
    /// Writes the positions of a keyframe, in world space, and returns a warning about them. Throws
    /// Error(kBadInput) with file and frame if they cannot be used.
    std::function<std::optional<Warning>(std::size_t keyframe, std::span<vec3> out)> read = {};
};

/// a + (b - a) * f in float, for f in [0, 1). If a, b and b - a are finite, it lies between a and b
/// (docs/design/animations.md has the proof).
inline float interpolate(float a, float b, float f) { return f == 0.0f ? a : a + (b - a) * f; }

/// interpolate() makes positions between keyframes. Opening reads the first keyframe; a later one
/// that cannot be used makes positions() throw Error(kBadInput).
std::unique_ptr<Animation> stream_keyframes(const std::string& name, FirstMesh first,
                                            Keyframes keyframes, const WarnFunction& warn);

/// Each file is a keyframe. The first has the triangles, colours and textures; all must have its
/// faces. Throws Error(kBadInput) for the first file alone.
std::unique_ptr<Animation> open_keyframes(const std::vector<KeyframeFile>& files,
                                          const std::string& name, const AnimationOptions& options);

}  // namespace mray
