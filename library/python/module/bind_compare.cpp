// morphray.compare().
#include "morphray/compare.hpp"

#include "library/python/module/arrays.h"
#include "library/python/module/bindings.h"
#include "library/python/module/gil_release.h"
#include "library/python/module/scene.h"

namespace morphray::python {
namespace {

using py::arg;

Comparison compare_any(const py::object& first, const py::object& second, const py::object& rays,
                       std::size_t keep) {
    if (py::isinstance<PyScene>(first) && py::isinstance<PyScene>(second)) {
        if (rays.is_none()) throw py::type_error("compare: two scenes need rays to compare");
        return first.cast<PyScene&>().compare(second.cast<PyScene&>(), rays_of(rays), keep);
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

struct DifferenceRecord {
    std::uint64_t index;
    Hit first;
    Hit second;
};

py::array differences_of(const Comparison& comparison) {
    py::list fields;
    fields.append(py::make_tuple("index", py::dtype::of<std::uint64_t>()));
    fields.append(py::make_tuple("first", hit_dtype()));
    fields.append(py::make_tuple("second", hit_dtype()));
    const py::object dtype = py::module_::import("numpy").attr("dtype")(fields);
    py::array array(py::reinterpret_borrow<py::dtype>(dtype),
                    static_cast<py::ssize_t>(comparison.differences.size()));
    static_assert(sizeof(DifferenceRecord) == 48 && offsetof(DifferenceRecord, second) == 28);
    auto* const out = static_cast<DifferenceRecord*>(array.mutable_data());
    for (std::size_t i = 0; i < comparison.differences.size(); ++i) {
        const HitDifference& difference = comparison.differences[i];
        out[i] = {difference.index, difference.first, difference.second};
    }
    return array;
}

}  // namespace

void bind_compare(py::module_& module) {
    py::class_<Comparison>(module, "Comparison",
                           R"(The hits that differ in any bit. True if there are any:

    assert not morphray.compare(scene, twin, rays)

str() has a line for each of the first ones.)")
        .def_readonly("compared", &Comparison::compared, "The number of rays or pixels.")
        .def_readonly("different", &Comparison::different, "The number of those that differ.")
        .def_property_readonly("equal", &Comparison::equal, "Whether none differs.")
        .def_property_readonly(
            "differences", &differences_of,
            R"(A structured array of the first ones that differ, in ascending order.

Fields: index (of the ray, or of the pixel, row by row), first and second (hit_dtype).)")
        .def("__bool__", [](const Comparison& comparison) { return !comparison.equal(); })
        .def("__str__", &describe)
        .def("__repr__", [](const Comparison& comparison) {
            return "<morphray.Comparison " + std::to_string(comparison.different) + " of " +
                   std::to_string(comparison.compared) + " differ>";
        });
    module.def("compare", &compare_any,
               R"(compare(first, second, rays=None, keep=10)
--

Compares two scenes by tracing rays in both, in the order given, or two images by hits, occlusion and pixels.

rays: as Scene.intersect() takes them; needed for scenes, and not taken for images.
keep: how many of those that differ Comparison.differences has at most.

Returns a Comparison, which is true if anything differs.)",
               arg("first"), arg("second"), arg("rays") = py::none(), arg("keep") = 10);
}

}  // namespace morphray::python
