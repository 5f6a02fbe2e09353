// Rays and points from text or from an array of floats.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "common/scene/scene_space.h"
#include "morphray/geometry.hpp"

namespace mray::app {

/// Reads the lines of a text that have numbers. Numbers are rounded to float, like vertices, so
/// that a float printed with 9 digits is read back exactly; inf and nan are numbers. '#' begins a
/// comment; lines without numbers are skipped.
class NumberLines {
public:
    /// `name` is the file in messages, `form` what a line should be. All views must outlive the
    /// reader.
    NumberLines(std::string_view name, std::string_view text, std::string_view form)
        : name_(name), rest_(text), form_(form) {}

    /// Reads the next line into `numbers`. Returns how many it has; 0 at the end. Throws
    /// Error(kBadInput) for what is not a number, and for more numbers than there is room for.
    std::size_t next(std::span<double> numbers);
    /// Throws Error(kBadInput) that names the file and the line that was read last.
    [[noreturn]] void fail(const std::string& what) const;
    /// The number of lines that were read.
    std::uint64_t line() const { return line_; }

private:
    std::string_view name_;
    std::string_view rest_;
    std::string_view form_;
    std::uint64_t line_ = 0;
};

/// The number of lines of a text.
std::uint64_t count_lines(std::string_view text);

/// The content of a file, or of stdin for "-"; `content` is "rays" or "points". Throws
/// Error(kBadInput), kLimit.
std::string read_input(const std::string& file, const char* content);
/// The file as messages name it: "<stdin>" for "-".
std::string input_name(const std::string& file);

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

/// Reads the points of a text one by one, lines `x y z`.
class PointReader {
public:
    /// `name` is the file in messages. Both views must outlive the reader.
    PointReader(std::string_view name, std::string_view text)
        : lines_(name, text, "x y z"), total_(count_lines(text)) {}

    /// Returns false at the end. Throws Error(kBadInput) with the line.
    bool next(morphray::Vec3& point);
    /// The number of lines, and of those that were read.
    std::uint64_t total() const { return total_; }
    std::uint64_t position() const { return lines_.line(); }

private:
    NumberLines lines_;
    std::uint64_t total_ = 0;
};

}  // namespace mray::app
