// Rays from a text or from an array of floats.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/scene/scene_space.h"

namespace morphray::app {

/// Gives the rays of a text one by one: a line `ox oy oz dx dy dz [tnear tfar]` each, tnear 0 and
/// tfar inf where they are missing. Numbers are read as floats, like vertices, so that a float
/// printed with 9 digits comes back as itself; inf and nan are numbers. '#' begins a comment; lines
/// without anything else are skipped.
class RayTextReader {
public:
    /// `name` is what errors call the text; both views must outlive the reader.
    RayTextReader(std::string_view name, std::string_view text) : name_(name), rest_(text) {}

    /// False at the end. Throws Error(kBadInput) with the line.
    bool next(WorldRay& ray);

private:
    std::string_view name_;
    std::string_view rest_;
    std::uint64_t line_ = 0;
};

/// Likewise for 8 little-endian floats a ray.
class RayBinaryReader {
public:
    /// Throws Error(kBadInput) when the last ray is cut off.
    RayBinaryReader(std::string_view name, std::string_view bytes);

    bool next(WorldRay& ray);

private:
    std::string_view rest_;
};

/// The whole of a file, or of stdin for "-". Throws Error(kBadInput), kLimit.
std::string read_rays(const std::string& file);

}  // namespace morphray::app
