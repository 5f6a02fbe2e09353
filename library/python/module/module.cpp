// The module morphray._morphray with its dtypes, Error and Device.
#include "library/python/module/module.h"

#include <fmt/format.h>
#include <pybind11/eval.h>

#include <algorithm>
#include <cstring>

#include "library/python/module/arrays.h"
#include "morphray/version.hpp"

namespace morphray::python {
namespace {

using py::arg;

py::dtype new_dtype(const std::string& fields) {
    return py::module_::import("numpy").attr("dtype")(py::eval(fields));
}
py::dtype new_closest_dtype(const std::string& number) {
    return new_dtype("[('point', '" + number +
                     "', (3,)), ('distance', 'f4'), ('u', 'f4'), ('v', 'f4'), ('prim_id', 'u4'), "
                     "('geom_id', 'u4'), ('feature', 'u4')]");
}

constexpr const char* kErrorDoc =
    R"(What the library throws: one line that says what is wrong and what to do.

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

void bind_devices(py::module_& module) {
    const auto host = [](Device (*make)(const CpuOptions&)) {
        return [make](int threads, const std::string& simd) { return make({threads, simd}); };
    };
    py::class_<Device>(
        module, "Device",
        R"(Where scenes live and rays are traced. Made by cpu(), vulkan() or brute_force().

Threads may use a device at the same time, for any number of scenes. Scenes that share a Device of
Vulkan start it once; the string "vulkan" starts another one.)")
        .def_static("cpu", host(&Device::cpu), py::call_guard<GilRelease>(),
                    R"(The processors of this machine. Results do not depend on the arguments.

threads: 0 is one for each processor
simd:    an instruction set of simd_targets(), "" for the best one, "off" for portable code)",
                    arg("threads") = 0, arg("simd") = "")
        .def_static(
            "vulkan",
            [](const std::string& device, bool validate) {
                return Device::vulkan({.device = device, .validate = validate});
            },
            py::call_guard<GilRelease>(),
            R"(A Vulkan 1.1 device. To start it takes from 0.1 s to some seconds.

device:   an index of vulkan_devices(), a part of the name of one device, or a UUID. "": the first
          usable device, discrete before integrated, virtual, CPU
validate: enable the Khronos validation layer)",
            arg("device") = "", arg("validate") = false)
        .def_static("brute_force", host(&Device::brute_force), py::call_guard<GilRelease>(),
                    "Tests every triangle for every ray.", arg("threads") = 0, arg("simd") = "")
        .def_property_readonly("name", &Device::name, R"("cpu", "vulkan" or "brute".)")
        .def_property_readonly("description", &Device::description,
                               "For people: instruction set and threads, or name and driver.")
        .def("digest", &digest, py::call_guard<GilRelease>(),
             R"(The hash of the device's answers about a small scene: DIGEST if all bits are right.

Takes about a second, and on Vulkan the time to compile kernels. docs/guide/crosscheck.md says what
it covers.)")
        .def("__repr__", [](const Device& device) {
            return fmt::format("<morphray.Device {}: {}>", device.name(), device.description());
        });

    py::class_<VulkanDeviceInfo>(module, "VulkanDeviceInfo", "A device of vulkan_devices().")
        .def_readonly("index", &VulkanDeviceInfo::index)
        .def_readonly("name", &VulkanDeviceInfo::name)
        .def_readonly("type", &VulkanDeviceInfo::type,
                      R"("discrete", "integrated", "virtual", "cpu" or "other".)")
        .def_readonly("driver", &VulkanDeviceInfo::driver)
        .def_readonly("uuid", &VulkanDeviceInfo::uuid)
        .def_readonly("memory_bytes", &VulkanDeviceInfo::memory_bytes)
        .def_readonly("unusable", &VulkanDeviceInfo::unusable,
                      R"("" if Device.vulkan() can use the device; otherwise what it lacks.)");

    module.def("vulkan_devices", &vulkan_devices, py::call_guard<GilRelease>(),
               "A list of VulkanDeviceInfo. Raises Error \"unavailable\".");
    module.def("simd_targets", &simd_targets,
               "What Device.cpu() accepts on this machine, the best one first.");
}

}  // namespace

const Dtypes& dtypes() {
    // Never freed: the interpreter may end before static objects do.
    static const Dtypes& all = *new Dtypes{
        new_dtype("[('org', 'f4', (3,)), ('tnear', 'f4'), ('dir', 'f4', (3,)), ('tfar', 'f4')]"),
        new_dtype("[('t', 'f4'), ('u', 'f4'), ('v', 'f4'), ('prim_id', 'u4'), ('geom_id', 'u4')]"),
        new_closest_dtype("f4"), new_closest_dtype("f8")};
    return all;
}

void throw_choice(const std::string& argument, const std::string& value,
                  const std::string& choices) {
    throw py::value_error(fmt::format("{}: \"{}\" is none of {}", argument, value, choices));
}

int find_choice(const std::string& argument, const py::object& value,
                std::initializer_list<const char*> names) {
    const std::string text = py::str(value);
    const auto* const found = std::ranges::find(names, text);
    if (found == names.end())
        throw_choice(argument, text, fmt::format("\"{}\"", fmt::join(names, "\", \"")));
    return static_cast<int>(found - names.begin());
}

}  // namespace morphray::python

PYBIND11_MODULE(_morphray, module) {
    using namespace morphray::python;
    module.attr("__version__") = morphray::version();
    module.attr("INVALID_ID") = morphray::kNoPrim;
    module.attr("DIGEST") = morphray::kDigest;
    module.attr("ray_dtype") = dtypes().ray;
    module.attr("hit_dtype") = dtypes().hit;
    module.attr("closest_dtype") = dtypes().closest;
    bind_errors(module);
    bind_devices(module);
    bind_scene(module);
}
