// Files with the hits of images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "morphray/error.hpp"
#include "morphray/geometry.hpp"
#include "morphray/image.hpp"

namespace morphray {

/// Collects the hits of images of one size and writes them to a file. Little-endian throughout:
///
///     char[8]  "MRHITS1\0"
///     uint32   width, height, number of images
///     then, image after image,
///         width * height times {float32 t, u, v; uint32 prim_id}, row by row from the top: t is
///         the
///             depth along the viewing direction; a miss is {infinity, 0, 0, 0xFFFFFFFF}
///         width * height times uint32: occluded secondary rays
///
/// One thread at a time.
class MORPHRAY_API HitsWriter {
public:
    HitsWriter(std::uint32_t width, std::uint32_t height);

    /// An image with several samples a pixel counts by its hits: its sides are longer by the square
    /// root of their number. Throws bad_argument for an image of another size, and for hits of
    /// another mesh than geom_id 0, for which the file has no place; limit. What throws has changed
    /// nothing.
    void add(const Image& image);
    /// Writes the file with the images so far: as a whole, or not at all. Throws output.
    void write(const std::string& file) const;

private:
    std::uint32_t width_;
    std::uint32_t height_;
    std::uint32_t image_count_ = 0;
    /// The file.
    std::vector<std::byte> bytes_;
};

/// A file of HitsWriter.
struct HitsFile {
    struct ImageHits {
        std::vector<Hit> hits = {};
        std::vector<std::uint32_t> occlusion = {};
    };
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<ImageHits> images = {};
};

/// Throws bad_input, with the reason, for a file that cannot be read or is not such a file.
MORPHRAY_API HitsFile read_hits(const std::string& file);

}  // namespace morphray
