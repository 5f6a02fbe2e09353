// morphray.Device, and what there is to choose from.
#include <pybind11/stl.h>

#include "library/python/module/bindings.h"
#include "library/python/module/interruptible.h"
#include "morphray/device.hpp"

namespace morphray::python {

using py::arg;

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
            R"(cpu(threads=0, simd="")
--

The processors of this machine. Results do not depend on the arguments.

threads: 0 is one for each processor
simd:    an instruction set of simd_targets(), "" for the best one, "off" for portable code)",
            arg("threads") = 0, arg("simd") = "")
        .def_static(
            "vulkan",
            [](const std::string& device, bool validate) {
                const GilRelease release;
                return Device::vulkan({.device = device, .validate = validate});
            },
            R"(vulkan(device="", validate=False)
--

A Vulkan 1.1 device. Starting it compiles its kernels, which takes from 0.1 s to some seconds.

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
            "brute_force(threads=0, simd=\"\")\n--\n\nTests every triangle for every ray.",
            arg("threads") = 0, arg("simd") = "")
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
               "vulkan_devices()\n--\n\nA list of VulkanDeviceInfo. Raises Error \"unavailable\".");
    module.def(
        "simd_targets", &simd_targets,
        "simd_targets()\n--\n\nWhat Device.cpu() accepts on this machine, the best one first.");
}

}  // namespace morphray::python
