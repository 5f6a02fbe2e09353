// Arrays in files of numpy (NumPy Enhancement Proposal 1).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mray::app {

/// Whether the bytes begin as such a file does.
bool is_npy(std::string_view bytes);

/// Returns a file of `count` records, whose bytes follow one another without gaps. `fields` are
/// those of a record as numpy writes them: "('t', '<f8'), ('point', '<f4', (3,)), ".
std::string npy_file(std::string_view fields, std::size_t count, std::string_view bytes);

/// An array of N x 3 floats or doubles in a file.
struct NpyPoints {
    std::size_t count = 0;
    /// 4 or 8 bytes a number.
    std::size_t number_bytes = 0;
    /// Little-endian, point after point; a part of the file's bytes.
    std::string_view numbers;
};
/// Throws Error(kBadInput), which begins with `name`, for any other array and for a file that is
/// cut off or too long.
NpyPoints read_npy_points(std::string_view name, std::string_view bytes);

}  // namespace mray::app
