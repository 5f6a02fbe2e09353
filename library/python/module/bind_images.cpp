// morphray.Image.
#include <pybind11/stl/filesystem.h>

#include <filesystem>

#include "library/python/module/arrays.h"
#include "library/python/module/bindings.h"
#include "library/python/module/scene.h"
#include "morphray/images.hpp"

namespace morphray::python {
namespace {

using py::arg;

/// A read-only view of memory of `owner`.
py::array view(const py::dtype& dtype, const std::vector<py::ssize_t>& shape, const void* data,
               const py::object& owner) {
    py::array array(dtype, shape, data, owner);
    array.attr("setflags")(arg("write") = false);
    return array;
}

py::array pixels_of(const py::object& self) {
    const auto& image = self.cast<const Image&>();
    return view(py::dtype::of<std::uint8_t>(), {image.height, image.width, 4}, image.pixels.data(),
                self);
}

/// The shape of arrays with one element for each camera ray.
std::vector<py::ssize_t> sample_shape_of(const Image& image) {
    const py::ssize_t side = sample_side(image.samples);
    return {side * image.height, side * image.width};
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

t is the depth along the viewing direction. Several samples a pixel are a square of elements.)")
        .def_property_readonly("occlusion", &occlusion_of,
                               "uint32 of the shape of hits: occluded shadow and ambient-occlusion "
                               "rays of each camera ray.")
        .def_readonly("ray_count", &Image::ray_count, "The rays that were traced.")
        .def_readonly("trace_ms", &Image::trace_ms, "The time of the trace in milliseconds.")
        .def_readonly("hits_hash", &Image::hits_hash,
                      "XXH3 (64 bits) of hits and occlusion: the same on every device and machine.")
        .def_readonly("image_hash", &Image::image_hash, "XXH3 (64 bits) of the pixels.")
        .def(
            "save",
            [](const Image& image, const std::filesystem::path& file) {
                if (file.extension() != ".png" && file.extension() != ".PNG") {
                    throw py::value_error("save: " + file.string() +
                                          " does not end in .png, the format of the file");
                }
                const GilRelease release;
                write_png(file.string(), image);
            },
            "Writes a PNG file, as a whole or not at all. Raises ValueError for a name of another "
            "format.",
            arg("path"))
        .def("__repr__", [](const Image& image) {
            return "<morphray.Image " + std::to_string(image.width) + "x" +
                   std::to_string(image.height) + ">";
        });
}

}  // namespace morphray::python
