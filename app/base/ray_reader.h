// Rays and points from text or from an array of floats.
#pragma once

#include <string>

#include "common/scene/scene_space.h"
#include "morphray/geometry.hpp"

namespace mray::app {

// Files named "-" are stdin. In a text '#' begins a comment, and lines without numbers are skipped.
// Coordinates are those of the scene's file (common/scene/scene_space.h); other numbers are rounded
// to float. A float printed with 9 digits is read back exactly; inf and nan are numbers. Each
// function throws Error(kBadInput) with file and line, and kLimit for too large a file.

struct RayFile {
    std::vector<WorldRay> rays = {};
    /// For each ray the triangle that it leaves out, or none; empty if no ray names one.
    std::vector<morphray::Primitive> excluded = {};
};

/// Lines `ox oy oz dx dy dz [tnear tfar [prim_id]]`, by default from 0 to inf and without leaving
/// out a triangle; with `is_binary` the little-endian bytes of struct Ray each; or a .npy file of
/// ray_dtype, or of float32 or float64 of shape (..., 6) or (..., 8).
RayFile read_rays(const std::string& file, bool is_binary);

/// The points of a file, lines `x y z` or a .npy file of float32 or float64 of shape (..., 3).
std::vector<glm::dvec3> read_points(const std::string& file);

/// The file as messages name it: "<stdin>" for "-".
std::string input_name(const std::string& file);

}  // namespace mray::app
