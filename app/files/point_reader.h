// Reads points from text or from an array of numpy.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "app/files/npy.h"
#include "app/files/number_lines.h"
#include "morphray/geometry.hpp"

namespace mray::app {

/// Reads the points of a file one by one: lines `x y z`, or what read_npy_points() reads. Doubles
/// are rounded to float.
class PointReader {
public:
    /// `name` is the file in messages. Both views must outlive the reader. Throws Error(kBadInput).
    PointReader(std::string_view name, std::string_view bytes);

    /// Returns false at the end. Throws Error(kBadInput) with the line.
    bool next(morphray::Vec3& point);
    /// How much there is, and how much was read: points of an array, or lines.
    std::uint64_t total() const { return total_; }
    std::uint64_t position() const { return array_ ? read_ : lines_.line(); }

private:
    NumberLines lines_;
    std::optional<NpyPoints> array_;
    std::uint64_t total_ = 0;
    std::uint64_t read_ = 0;
};

}  // namespace mray::app
