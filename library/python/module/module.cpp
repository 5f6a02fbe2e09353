// The module morphray._morphray with its dtypes, Error, Device and keyword arguments; __init__.py
// makes its names public.
#include "library/python/module/module.h"

#include <pybind11/eval.h>

#include <cstring>

#include "library/python/module/arrays.h"
#include "morphray/error.hpp"
#include "morphray/version.hpp"

namespace morphray::python {
namespace {

using py::arg;

py::dtype dtype_of(const std::string& fields) {
    const py::module_ numpy = py::module_::import("numpy");
    return py::reinterpret_borrow<py::dtype>(numpy.attr("dtype")(py::eval(fields)));
}

py::dtype closest_dtype_of(const std::string& number) {
    return dtype_of("[('point', '" + number +
                    "', (3,)), ('distance', 'f4'), ('u', 'f4'), ('v', 'f4'), ('prim_id', 'u4'), "
                    "('geom_id', 'u4'), ('feature', 'u4')]");
}

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

void bind_devices(py::module_& module) {
    py::class_<Device>(
        module, "Device",
        R"(Where scenes live and rays are traced. Made by cpu(), vulkan() or brute_force().

Threads may use a device at the same time, for any number of scenes. Scenes that share a Device of
Vulkan start it once; the string "vulkan" starts another one.)")
        .def_static(
            "cpu",
            [](int threads, const std::string& simd) {
                const GilRelease release;
                return Device::cpu({.threads = threads, .simd = simd});
            },
            R"(The processors of this machine. Results do not depend on the arguments.

threads: 0 is one for each processor
simd:    an instruction set of simd_targets(), "" for the best one, "off" for portable code)",
            arg("threads") = 0, arg("simd") = "")
        .def_static(
            "vulkan",
            [](const std::string& device, bool validate) {
                const GilRelease release;
                return Device::vulkan({.device = device, .validate = validate});
            },
            R"(A Vulkan 1.1 device. To start it takes from 0.1 s to some seconds.

device:   an index of vulkan_devices(), a part of the name of one device, or a UUID. "": the first
          usable device, discrete before integrated, virtual, CPU
validate: enable the Khronos validation layer)",
            arg("device") = "", arg("validate") = false)
        .def_static(
            "brute_force",
            [](int threads, const std::string& simd) {
                const GilRelease release;
                return Device::brute_force({.threads = threads, .simd = simd});
            },
            "Tests every triangle for every ray.", arg("threads") = 0, arg("simd") = "")
        .def_property_readonly("name", &Device::name, R"("cpu", "vulkan" or "brute".)")
        .def_property_readonly("description", &Device::description,
                               "For people: instruction set and threads, or name and driver.")
        .def("__repr__", [](const Device& device) {
            return "<morphray.Device " + device.name() + ": " + device.description() + ">";
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
                      R"("" if Device.vulkan() can use the device; otherwise what it lacks.)")
        .def("__repr__", [](const VulkanDeviceInfo& info) {
            return "<morphray.VulkanDeviceInfo " + std::to_string(info.index) + ": " + info.name +
                   (info.unusable.empty() ? "" : ", unusable: " + info.unusable) + ">";
        });

    module.def("vulkan_devices", &vulkan_devices, py::call_guard<GilRelease>(),
               "A list of VulkanDeviceInfo. Raises Error \"unavailable\".");
    module.def("simd_targets", &simd_targets,
               "What Device.cpu() accepts on this machine, the best one first.");
}

// ---- Keyword arguments

[[noreturn]] void throw_choice(const std::string& name, const std::string& value,
                               const std::string& choices) {
    throw py::value_error(name + ": \"" + value + "\" is none of " + choices);
}

template <class Value>
Value choice(const std::string& name, const py::object& given,
             std::initializer_list<std::pair<const char*, Value>> values) {
    const std::string text = py::str(given);
    std::string choices;
    for (const auto& [choice, value] : values) {
        if (text == choice) return value;
        choices += (choices.empty() ? "\"" : "\", \"") + std::string(choice);
    }
    throw_choice(name, text, choices + "\"");
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

Device device_of(const py::object& device) {
    if (py::isinstance<Device>(device)) return device.cast<Device>();
    const std::string text = py::str(device);
    const GilRelease release;
    if (text == "cpu") return Device::cpu();
    if (text == "vulkan") return Device::vulkan();
    if (text == "brute") return Device::brute_force();
    throw_choice("device", text,
                 R"("cpu", "vulkan" and "brute"; Device.vulkan() takes the name of a device)");
}

Coherence coherence_of(const py::object& coherence) {
    const char* const wanted = R"(coherence: "none", "sort" or the width of an image)";
    if (!py::isinstance<py::str>(coherence))
        return Coherence::image(value_of<std::uint32_t>(coherence, wanted));
    const std::string name = py::str(coherence);
    if (name == "none") return Coherence::none();
    if (name == "sort") return Coherence::sort();
    throw_choice("coherence", name, R"("none" and "sort", or the width of an image)");
}

UpdatePolicy policy_of(const std::string& update, double budget_ms, double budget,
                       bool deterministic) {
    UpdatePolicy policy;
    try {
        policy = parse_update_policy(update);
    } catch (const Error& error) {
        throw py::value_error(std::string("update: ") + error.what());
    }
    const Auto automatic{budget_ms, budget, deterministic};
    if (std::holds_alternative<Auto>(policy)) return automatic;
    const Auto defaults;
    if (budget_ms != defaults.budget_ms || budget != defaults.budget || deterministic) {
        throw py::value_error("update: \"" + update +
                              "\" takes no budget_ms, budget or deterministic; \"auto\" does");
    }
    return policy;
}

Rays rays_named(const py::object& rays) {
    return choice<Rays>("rays", rays,
                        {{"primary", Rays::primary}, {"shadow", Rays::shadow}, {"ao", Rays::ao}});
}

Shading shading_named(const py::object& shading) {
    return choice<Shading>("shading", shading,
                           {{"plain", Shading::plain},
                            {"lit", Shading::lit},
                            {"normal", Shading::normal},
                            {"depth", Shading::depth},
                            {"prim", Shading::prim},
                            {"steps", Shading::steps},
                            {"sah", Shading::sah}});
}

Crossing crossing_named(const py::object& crossing) {
    return choice<Crossing>(
        "crossing", crossing,
        {{"once", Crossing::once}, {"each", Crossing::each}, {"owner", Crossing::owner}});
}

FillRule rule_named(const py::object& rule) {
    return choice<FillRule>("rule", rule, {{"nonzero", FillRule::nonzero}, {"odd", FillRule::odd}});
}

Threads threads_named(const py::object& threads) {
    return choice<Threads>("threads", threads,
                           {{"all", Threads::all}, {"calling", Threads::calling}});
}

Wrap wrap_named(const py::object& wrap) {
    return choice<Wrap>("wrap", wrap, {{"repeat", Wrap::repeat}, {"clamp", Wrap::clamp}});
}

}  // namespace morphray::python

PYBIND11_MODULE(_morphray, module) {
    using namespace morphray::python;
    module.attr("__version__") = morphray::version();
    module.attr("INVALID_ID") = morphray::kNoPrim;
    module.attr("ray_dtype") = ray_dtype();
    module.attr("hit_dtype") = hit_dtype();
    module.attr("closest_dtype") = closest_dtype();
    bind_errors(module);
    bind_devices(module);
    bind_scene(module);
}
