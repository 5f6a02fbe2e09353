// The parts that module.cpp puts together, and conversions that more than one of them needs.
#pragma once

#include <pybind11/pybind11.h>

#include <optional>
#include <string>

#include "morphray/device.hpp"
#include "morphray/geometry.hpp"
#include "morphray/image.hpp"

namespace morphray::python {

namespace py = pybind11;

class Cancel;
class PyScene;

void bind_errors(py::module_& module);
void bind_devices(py::module_& module);
void bind_images(py::module_& module);
void bind_scene(py::module_& module);
void bind_compare(py::module_& module);

/// The questions of queries.hpp, as methods of Scene.
void bind_questions(py::class_<PyScene>& scene_class);

/// Null for None. Throws TypeError for what is no Cancel.
Cancel* cancel_of(const py::object& cancel);
/// A Device, or "cpu", "vulkan" or "brute".
Device device_of(const py::object& device, const std::string& name);
/// A sequence of three numbers.
Point point_of(const py::object& point, const std::string& name);
/// None is no point.
std::optional<Point> optional_point_of(const py::object& point, const std::string& name);

}  // namespace morphray::python
