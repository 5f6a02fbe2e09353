// morphray.Image and files of hits.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <memory>
#include <mutex>

#include "library/python/module/arrays.h"
#include "library/python/module/bindings.h"
#include "library/python/module/gil_release.h"
#include "library/python/module/options.h"
#include "morphray/hits.hpp"
#include "morphray/image.hpp"

namespace morphray::python {
namespace {

using py::arg;
using HitsImage = HitsFile::ImageHits;

/// A file of hits, with the size that its images have.
struct SizedHits {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    HitsImage image;
};

/// Threads take turns.
struct PyHitsWriter {
    PyHitsWriter(std::uint32_t width, std::uint32_t height) : writer(width, height) {}

    HitsWriter writer;
    std::mutex mutex;

    /// Calls `work(writer)` without the GIL.
    template <class Work>
    void use(Work work) {
        const GilRelease release;
        const std::scoped_lock lock(mutex);
        work(writer);
    }
};

/// A read-only view of memory of `owner`.
py::array view(const py::dtype& dtype, const std::vector<py::ssize_t>& shape, const void* data,
               const py::object& owner) {
    py::array array(dtype, shape, data, owner);
    array.attr("setflags")(arg("write") = false);
    return array;
}

template <class Sized>
std::vector<py::ssize_t> image_shape(const Sized& image) {
    return {static_cast<py::ssize_t>(image.height), static_cast<py::ssize_t>(image.width)};
}

py::array pixels_of(const py::object& self) {
    const auto& image = self.cast<const Image&>();
    std::vector<py::ssize_t> shape = image_shape(image);
    shape.push_back(4);
    return view(py::dtype::of<std::uint8_t>(), shape, image.pixels.data(), self);
}

/// The shape of arrays with one element for each camera ray.
std::vector<py::ssize_t> sample_shape_of(const Image& image) {
    std::vector<py::ssize_t> shape = image_shape(image);
    for (py::ssize_t& length : shape) length *= sample_side(image.samples);
    return shape;
}

py::array hits_of(const py::object& self) {
    const auto& image = self.cast<const Image&>();
    return view(hit_dtype(), sample_shape_of(image), image.hits.data(), self);
}

py::array occlusion_of(const py::object& self) {
    const auto& image = self.cast<const Image&>();
    return view(py::dtype::of<std::uint32_t>(), sample_shape_of(image), image.occlusion.data(),
                self);
}

py::array file_hits_of(const py::object& self) {
    const auto& hits = self.cast<const SizedHits&>();
    return view(hit_dtype(), image_shape(hits), hits.image.hits.data(), self);
}

py::array file_occlusion_of(const py::object& self) {
    const auto& hits = self.cast<const SizedHits&>();
    return view(py::dtype::of<std::uint32_t>(), image_shape(hits), hits.image.occlusion.data(),
                self);
}

std::vector<SizedHits> read_sized_hits(const std::filesystem::path& file) {
    HitsFile read = read_hits(file.string());
    std::vector<SizedHits> images;
    for (HitsImage& image : read.images)
        images.push_back({read.width, read.height, std::move(image)});
    return images;
}

}  // namespace

void bind_images(py::module_& module) {
    py::class_<Image>(module, "Image",
                      R"(An image of Scene.render() with the hits that it was made from.

The arrays are read-only views, row by row from the top; they keep the image alive. The
arrays can be pickled, the image cannot.)")
        .def_readonly("width", &Image::width, "In pixels.")
        .def_readonly("height", &Image::height, "In pixels.")
        .def_readonly("samples", &Image::samples, "Camera rays a pixel.")
        .def_property_readonly("pixels", &pixels_of,
                               "(height, width, 4) uint8: red, green, blue, alpha, in sRGB.")
        .def_property_readonly("hits", &hits_of,
                               R"((height, width) of hit_dtype: the hit of each camera ray.

t is the depth along the viewing direction, in world space. With several samples a pixel both sides
are longer by the square root of their number.)")
        .def_property_readonly("occlusion", &occlusion_of,
                               R"((height, width) uint32: occluded rays of each camera ray.

Of its shadow ray and its ambient-occlusion rays. With several samples shaped as hits.)")
        .def_readonly("ray_count", &Image::ray_count, "The rays that were traced.")
        .def_readonly("trace_ms", &Image::trace_ms, "The time of the trace in milliseconds.")
        .def_readonly("hits_hash", &Image::hits_hash,
                      R"(XXH3 (64 bits) of hits and occlusion: the same on every device and machine.

f"{image.hits_hash:016x}" is what the program `morphray render --json` reports.)")
        .def_readonly("image_hash", &Image::image_hash, "XXH3 (64 bits) of the pixels.")
        .def(
            "save",
            [](const Image& image, const std::filesystem::path& file) {
                const GilRelease release;
                write_png(file.string(), image);
            },
            R"(save(self, path)
--

Writes a PNG file: as a whole, or not at all. Raises Error "output" if it cannot be written.)",
            arg("path"))
        .def("__repr__", [](const Image& image) {
            return "<morphray.Image " + std::to_string(image.width) + "x" +
                   std::to_string(image.height) + ">";
        });

    py::class_<PyHitsWriter> writer_class(module, "HitsWriter", R"(HitsWriter(width, height)
--

Collects the hits of images of one size and writes them to a file. Threads take turns.

Little-endian: char[8] "MRHITS1\0"; uint32 width, height, number of images; then for each image
width * height times {float32 t, u, v; uint32 prim_id}, and width * height times uint32 occlusion.)");
    writer_class
        .def(py::init([](const py::object& width, const py::object& height) {
                 return std::make_unique<PyHitsWriter>(uint32_of(width, "width"),
                                                       uint32_of(height, "height"));
             }),
             "__init__(self, width, height)\n--\n\nSee the class.", arg("width"), arg("height"))
        .def(
            "add",
            [](PyHitsWriter& self, const Image& image) {
                self.use([&](HitsWriter& writer) { writer.add(image); });
            },
            R"(add(self, image)
--

Adds the hits of an Image; with several samples a pixel, width and height are those of `hits`. Raises
Error "bad_argument" for an image of another size, and for hits of another mesh than geom_id 0, for
which the file has no place.)",
            arg("image"))
        .def(
            "write",
            [](PyHitsWriter& self, const std::filesystem::path& file) {
                self.use([&](const HitsWriter& writer) { writer.write(file.string()); });
            },
            R"(write(self, path)
--

Writes the file with the images so far: as a whole, or not at all. Raises Error "output".)",
            arg("path"));

    py::class_<SizedHits>(module, "ImageHits", "The hits of an image, from read_hits().")
        .def_readonly("width", &SizedHits::width, "In pixels.")
        .def_readonly("height", &SizedHits::height, "In pixels.")
        .def_property_readonly("hits", &file_hits_of, "(height, width) of hit_dtype, read-only.")
        .def_property_readonly("occlusion", &file_occlusion_of,
                               "(height, width) uint32, read-only: occluded rays of each pixel.");
    module.def("read_hits", &read_sized_hits, py::call_guard<GilRelease>(),
               R"(read_hits(path)
--

The images of a file of HitsWriter: a list of ImageHits. Raises Error "bad_input" for a file that
cannot be read or is no such file.)",
               arg("path"));
}

}  // namespace morphray::python
