// morphray.Image and morphray.compare().
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cstddef>
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

Comparison compare_scenes(PyScene& first, PyScene& second, const QueryArray& rays,
                          std::size_t keep) {
    Comparison result;
    const auto compare_in = [&](const Scene& a, const Scene& b,
                                const std::atomic<bool>* cancelled) {
        // One batch: the hits of both take more memory than converted rays.
        for_each_batch(rays, rays.count, [&](std::size_t, std::span<const Ray> batch) {
            result = compare(a, b, batch, keep, {.cancel = cancelled});
        });
    };
    first.query(rays.count, nullptr, [&](const Scene& a, const std::atomic<bool>* cancelled) {
        if (&first == &second) return compare_in(a, a, cancelled);
        const std::shared_lock lock = second.query_lock();
        compare_in(a, second.scene(), cancelled);
    });
    return result;
}

Comparison compare_any(const py::object& first, const py::object& second, const py::object& rays,
                       std::size_t keep) {
    if (py::isinstance<PyScene>(first) && py::isinstance<PyScene>(second)) {
        if (rays.is_none()) throw py::type_error("compare: two scenes need rays to compare");
        PyScene& scene = first.cast<PyScene&>();
        return compare_scenes(scene, second.cast<PyScene&>(), rays_of(rays, scene.scene().origin()),
                              keep);
    }
    if (py::isinstance<Image>(first) && py::isinstance<Image>(second)) {
        if (!rays.is_none()) throw py::type_error("compare: two images take no rays");
        const auto& a = first.cast<const Image&>();
        const auto& b = second.cast<const Image&>();
        const GilRelease release;
        return compare(a, b, keep);
    }
    throw py::type_error("compare: two scenes or two images are needed");
}

py::array differences_of(const Comparison& comparison) {
    py::list fields;
    fields.append(py::make_tuple("index", py::dtype::of<std::uint64_t>()));
    fields.append(py::make_tuple("first", hit_dtype()));
    fields.append(py::make_tuple("second", hit_dtype()));
    const py::object dtype = py::module_::import("numpy").attr("dtype")(fields);
    py::array array(py::reinterpret_borrow<py::dtype>(dtype),
                    static_cast<py::ssize_t>(comparison.differences.size()));
    static_assert(sizeof(HitDifference) == 48 && offsetof(HitDifference, second) == 28);
    std::ranges::copy(comparison.differences, static_cast<HitDifference*>(array.mutable_data()));
    return array;
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

    py::class_<Comparison>(
        module, "Comparison",
        "The hits that differ in any bit. True if there are any; str() has the first ones.")
        .def_readonly("compared", &Comparison::compared, "The number of rays or pixels.")
        .def_readonly("different", &Comparison::different, "The number of those that differ.")
        .def_property_readonly("equal", &Comparison::equal, "Whether none differs.")
        .def_property_readonly(
            "differences", &differences_of,
            "The first ones that differ, with the fields index, first and second (hit_dtype).")
        .def("__bool__", [](const Comparison& comparison) { return !comparison.equal(); })
        .def("__str__", &describe)
        .def("__repr__", [](const Comparison& comparison) {
            return "<morphray.Comparison " + std::to_string(comparison.different) + " of " +
                   std::to_string(comparison.compared) + " differ>";
        });
    module.def(
        "compare", &compare_any,
        R"(Compares two scenes by tracing rays in both, or two images by hits, occlusion and pixels.

rays: as Scene.intersect() takes them; needed for scenes, and not taken for images
keep: how many of those that differ Comparison.differences has at most)",
        arg("first"), arg("second"), arg("rays") = py::none(), arg("keep") = 10);
}

}  // namespace morphray::python
