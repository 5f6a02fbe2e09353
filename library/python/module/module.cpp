// The extension module morphray._morphray, and morphray.Error. The package's __init__.py makes its
// names public.
#include <cstring>

#include "library/python/module/arrays.h"
#include "library/python/module/bindings.h"
#include "morphray/error.hpp"
#include "morphray/version.hpp"

namespace morphray::python {
namespace {

constexpr const char* kErrorDoc =
    R"(What the library throws: one line that says what is wrong and, where there is a remedy, what
to do. Arguments of a wrong type are a TypeError and arrays that do not fit a ValueError.

code: str
    "bad_argument"  An argument that no call accepts.
    "bad_input"     Triangles or a file that cannot be used: an index out of range.
    "unavailable"   A device or instruction set that this machine or build does not have.
    "output"        A file that cannot be written.
    "limit"         More memory, triangles or pixels than machine or library take.
    "device_lost"   The device stopped answering. The scene is of no use any more.
    "busy"          Another thread is changing this scene, or querying what is to be changed.
    "cancelled"     Cancel.set() has ended the call.
    "internal"      A broken invariant of the library: please report it.)";

/// The class; never freed, because the interpreter may end before static objects do.
py::object*& error_class() {
    static py::object* type = nullptr;
    return type;
}

void translate(std::exception_ptr pointer) {
    try {
        if (pointer) std::rethrow_exception(pointer);
    } catch (const Error& error) {
        // Paths need not be UTF-8.
        const py::object text = py::reinterpret_steal<py::object>(PyUnicode_DecodeUTF8(
            error.what(), static_cast<py::ssize_t>(std::strlen(error.what())), "backslashreplace"));
        py::object instance = (*error_class())(text);
        instance.attr("code") = to_string(error.code());
        PyErr_SetObject(error_class()->ptr(), instance.ptr());
    }
}

void bind_errors(py::module_& module) {
    py::dict members;
    members["code"] = "internal";
    error_class() = new py::object(py::reinterpret_steal<py::object>(
        PyErr_NewExceptionWithDoc("morphray.Error", kErrorDoc, PyExc_RuntimeError, members.ptr())));
    module.attr("Error") = *error_class();
    py::register_exception_translator(&translate);
}

}  // namespace
}  // namespace morphray::python

PYBIND11_MODULE(_morphray, module) {
    using namespace morphray::python;
    // Docstrings have signatures in the form that inspect.signature() reads.
    py::options options;
    options.disable_function_signatures();

    module.attr("__version__") = morphray::version();
    module.attr("INVALID_ID") = morphray::kNoPrim;
    module.attr("ray_dtype") = ray_dtype();
    module.attr("hit_dtype") = hit_dtype();
    module.attr("closest_dtype") = closest_dtype();
    bind_errors(module);
    bind_devices(module);
    bind_images(module);
    bind_scene(module);
}
