// Images of a scene, files of their hits, and comparisons.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "morphray/error.hpp"
#include "morphray/geometry.hpp"
#include "morphray/queries.hpp"

namespace morphray {

/// The rays of an image.
enum class Rays {
    primary,  ///< Camera rays, shaded as if lit from the camera.
    shadow,   ///< and a ray to the light from each hit.
    ao,       ///< and ambient-occlusion rays from each hit.
};

/// The meaning of the colours of an image.
enum class Shading {
    plain,   ///< The light of View::rays on flat triangles.
    lit,     ///< A light with shadows and a sky with ambient occlusion, on smooth surfaces.
    normal,  ///< Normals as colours.
    depth,   ///< Depths along the viewing direction as greys, the nearer the brighter.
    prim,    ///< Triangles in colours of their own.
};

/// The side of the square of camera rays of a pixel that has `samples` of them: 1, 2, 4 or 8.
constexpr std::uint32_t sample_side(std::uint32_t samples) {
    std::uint32_t side = 1;
    while (side * side < samples && side < 8) side *= 2;
    return side;
}

/// A calibrated camera, with OpenCV's axes: x right, y down, z forward. A point (x, y, z) in its
/// space is seen (fx * x / z + cx, fy * y / z + cy) pixels from the upper left corner of the image,
/// where the centre of the first pixel is (0.5, 0.5). OpenCV counts from that centre: add 0.5 to
/// its principal point. Scene::intersect() has the same bits for the rays of docs/guide/sensors.md
/// if the camera is nearer than 500 sizes of the scene.
struct Pinhole {
    /// A rotation and a translation, row by row: from the camera's space to the caller's
    /// coordinates. The columns are the axes of the camera and its place.
    std::array<std::array<double, 4>, 3> to_world = {};
    double fx = 0;
    double fy = 0;
    double cx = 0;
    double cy = 0;
};

/// A pinhole camera and a light, in the caller's coordinates. What is not given is chosen so that
/// the bounds of the scene fill the image.
struct View {
    std::optional<Point> eye = {};
    std::optional<Point> target = {};
    Point up = {0, 1, 0};
    double fov = 45;  ///< Vertical, in degrees, between 0 and 180.
    /// Takes the place of eye, target and fov. `up` is then the direction of the sky alone.
    std::optional<Pinhole> pinhole = {};
    /// Things that are lower than 1/46000 of the way to the light cast no shadow, so a sun is best
    /// put some tens of sizes of the scene away.
    std::optional<Point> light = {};
    /// In pixels, from 1 to 65536 a side and at most 2^28 in all.
    std::uint32_t width = 1024;
    std::uint32_t height = 1024;
    /// For Shading::plain; with any other, Shading chooses the rays.
    Rays rays = Rays::primary;
    Shading shading = Shading::plain;
    /// Camera rays a pixel, 1, 4, 16 or 64: a square of them, whose colours are averaged.
    std::uint32_t samples = 1;
    bool flat = false;    ///< Whether Shading::lit and normal leave out smooth normals.
    bool linear = false;  ///< Whether Shading::lit fills Image::linear, too.
    /// Ambient-occlusion rays a camera ray, from 1 to 256; with Shading::lit also 0, for none.
    std::uint32_t ao_count = 16;
    /// Length of ambient-occlusion rays. 0: a quarter of the diagonal of the bounds.
    double ao_distance = 0;
    /// Whether Image::hits, occlusion and hits_hash are filled. Without them an image takes less
    /// time and memory; its pixels are the same.
    bool hits = true;
    /// If it is given, render() throws cancelled soon after another thread has made it true: within
    /// some milliseconds on the CPU, by brute force once each thread has finished a row of at most
    /// 64 pixels, and on a device at the end of a submission of some tens of milliseconds, or of
    /// compiling a kernel that it uses for the first time.
    const std::atomic<bool>* cancel = nullptr;
    /// If it is given, render() adds to it, 1 in all, in the pass that traces most rays.
    std::atomic<double>* progress = nullptr;
};

/// An image with the hits that it was made from, row by row from the top.
struct Image {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::uint32_t samples = 1;  ///< View::samples.
    /// 8 bits a channel, sRGB: red in bits 0 to 7, green in 8 to 15, blue in 16 to 23, alpha above.
    std::vector<std::uint32_t> pixels;
    /// The hit of each camera ray; empty if View::hits is false. t is the depth along the viewing
    /// direction, in world space. With several samples these are the hits of an image whose sides
    /// are sample_side(samples) times as long, and so is `occlusion`.
    std::vector<Hit> hits;
    /// The number of occluded shadow and ambient-occlusion rays of each camera ray, with smooth
    /// normals as its colour shows the shadow; empty if View::hits is false.
    std::vector<std::uint32_t> occlusion;
    /// Linear red, green and blue of each pixel, the mean of its samples; empty unless View::linear
    /// asks for them.
    std::vector<std::array<float, 3>> linear;
    std::uint64_t ray_count = 0;  ///< The rays that were traced.
    /// The time of the trace; a device takes it by its own clock, if it has one.
    double trace_ms = 0;
    /// The part of trace_ms that the colours took, with any Shading but plain, and with several
    /// samples; else 0.
    double shade_ms = 0;
    /// XXH3 (64 bits) of hits and occlusion, and of the pixels: the same on every device and
    /// machine. They are what `morphray render --json` reports. hits_hash is 0 if View::hits is
    /// false.
    std::uint64_t hits_hash = 0;
    std::uint64_t image_hash = 0;
};

/// The caller's arrays for the pixels of views of one size: view after view, row by row from the
/// top. Scene::render() fills those that have room for all pixels; the others are empty.
struct ImageStack {
    /// Along the viewing direction, as t of Image::hits; infinite without a hit.
    std::span<float> depth = {};
    /// Along the ray: depth * |dir| (Pinhole), in doubles, rounded once to a float. |dir| is the
    /// root of (x * x + y * y) + z * z.
    std::span<float> distance = {};
    /// kNoGeometry and kNoPrim without a hit.
    std::span<std::uint32_t> geom_id = {};
    std::span<std::uint32_t> prim_id = {};
    std::span<Vec3> normal = {};              ///< As Scene::normals(), not smooth; 0 without a hit.
    std::span<std::array<float, 2>> uv = {};  ///< Hit::u and v; 0 without a hit.
    std::span<std::uint32_t> shaded = {};     ///< As Image::pixels.

    /// Set by render(), as in Image. The CPU's trace_ms includes the making of all channels.
    std::uint64_t ray_count = 0;
    double trace_ms = 0;
};

/// Writes a PNG file: as a whole, or not at all. Throws output if it cannot be written, and
/// bad_argument for an image whose pixels do not fit its size.
MORPHRAY_API void write_png(const std::string& file, const Image& image);

/// Collects the hits of images of one size and writes them to a file. Little-endian throughout:
///
///     char[8]  "MRHITS1\0"
///     uint32   width, height, number of images
///     then, image after image,
///         width * height times {float32 t, u, v; uint32 prim_id}, row by row from the top, with
///             the depth t of Image::hits; a miss is {infinity, 0, 0, 0xFFFFFFFF}
///         width * height times uint32: occluded secondary rays
///
/// One thread at a time.
class MORPHRAY_API HitsWriter {
public:
    HitsWriter(std::uint32_t width, std::uint32_t height);

    /// With several samples a pixel the size is that of Image::hits. Throws bad_argument for an
    /// image of another size, and for hits of another mesh than geom_id 0, for which the file has
    /// no place; limit. What throws has changed nothing.
    void add(const Image& image);
    /// Writes the file with the images so far: as a whole, or not at all. Throws output.
    void write(const std::string& file) const;

private:
    std::uint32_t width_;
    std::uint32_t height_;
    std::uint32_t image_count_ = 0;
    std::vector<std::byte> bytes_;  ///< The file.
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

class Scene;

struct HitDifference {
    /// The number of the ray, or of the camera ray of an image, row by row.
    std::size_t index = 0;
    Hit first;
    Hit second;
};

/// The hits that differ in any bit.
struct Comparison {
    std::uint64_t compared = 0;
    std::uint64_t different = 0;
    /// The first ones, in ascending order.
    std::vector<HitDifference> differences;

    bool equal() const { return different == 0; }
};

/// Traces the rays in both scenes. `keep` limits Comparison::differences. Throws as intersect().
MORPHRAY_API Comparison compare(const Scene& first, const Scene& second, std::span<const Ray> rays,
                                std::size_t keep = 10, const QueryOptions& options = {});
/// Compares hits, occlusion and pixels; what differs counts once for each camera ray. Throws
/// bad_argument for images of different sizes.
MORPHRAY_API Comparison compare(const Image& first, const Image& second, std::size_t keep = 10);

/// "1000 equal", or "3 of 1000 differ" and a line for each of the first ones.
MORPHRAY_API std::string describe(const Comparison& comparison);

}  // namespace morphray
