// The structured dtypes of rays and results.
#include <pybind11/eval.h>

#include "library/python/module/arrays.h"

namespace morphray::python {
namespace {

py::dtype dtype_of(const std::string& fields) {
    const py::module_ numpy = py::module_::import("numpy");
    return py::reinterpret_borrow<py::dtype>(numpy.attr("dtype")(py::eval(fields)));
}

py::dtype closest_dtype_of(const std::string& number) {
    return dtype_of("[('point', '" + number +
                    "', (3,)), ('distance', 'f4'), ('u', 'f4'), ('v', 'f4'), ('prim_id', 'u4'), "
                    "('geom_id', 'u4'), ('feature', 'u4')]");
}

}  // namespace

const py::dtype& ray_dtype() {
    // Never freed: the interpreter may end before static objects do.
    static const auto* const dtype = new py::dtype(
        dtype_of("[('org', 'f4', (3,)), ('tnear', 'f4'), ('dir', 'f4', (3,)), ('tfar', 'f4')]"));
    return *dtype;
}

const py::dtype& hit_dtype() {
    static const auto* const dtype = new py::dtype(
        dtype_of("[('t', 'f4'), ('u', 'f4'), ('v', 'f4'), ('prim_id', 'u4'), ('geom_id', 'u4')]"));
    return *dtype;
}

const py::dtype& closest_dtype() {
    static const auto* const dtype = new py::dtype(closest_dtype_of("f4"));
    return *dtype;
}

const py::dtype& far_closest_dtype() {
    static const auto* const dtype = new py::dtype(closest_dtype_of("f8"));
    return *dtype;
}

}  // namespace morphray::python
