// Reads rays from text or from an array of floats.
#pragma once

#include <cstdint>
#include <string_view>

#include "app/files/number_lines.h"
#include "common/scene/scene_space.h"

namespace mray::app {

/// Reads the rays of a text one by one. Each is a line `ox oy oz dx dy dz [tnear tfar]`; tnear
/// defaults to 0 and tfar to inf.
class RayTextReader {
public:
    /// `name` is the file in messages. Both views must outlive the reader.
    RayTextReader(std::string_view name, std::string_view text)
        : lines_(name, text, "ox oy oz dx dy dz [tnear tfar]") {}

    /// Returns false at the end. Throws Error(kBadInput) with the line.
    bool next(WorldRay& ray);
    /// The number of lines that were read.
    std::uint64_t position() const { return lines_.line(); }

private:
    NumberLines lines_;
};

/// Reads rays of 8 little-endian floats each.
class RayBinaryReader {
public:
    /// Throws Error(kBadInput) if the last ray is cut off.
    RayBinaryReader(std::string_view name, std::string_view bytes);

    bool next(WorldRay& ray);
    /// The number of rays that were read.
    std::uint64_t position() const { return count_; }

private:
    std::string_view rest_;
    std::uint64_t count_ = 0;
};

}  // namespace mray::app
