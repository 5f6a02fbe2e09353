// The parts that module.cpp puts together, and keyword arguments as options of C++.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <optional>
#include <string>

#include "morphray/device.hpp"
#include "morphray/image.hpp"
#include "morphray/scene.hpp"

namespace morphray::python {

namespace py = pybind11;

class Cancel;
class PyScene;

/// Images, and comparing them or scenes.
void bind_images(py::module_& module);
void bind_scene(py::module_& module);
/// The queries of queries.hpp, as methods of Scene.
void bind_queries(py::class_<PyScene>& scene_class);

/// Null for None. Throws TypeError for what is no Cancel.
Cancel* cancel_of(const py::object& cancel);
/// A Device, or "cpu", "vulkan" or "brute".
Device device_of(const py::object& device, const std::string& name);
/// A sequence of three numbers.
Point point_of(const py::object& point, const std::string& name);
/// None is no point.
std::optional<Point> optional_point_of(const py::object& point, const std::string& name);
/// None, or a lower and an upper point.
std::optional<Box> bounds_of(const py::object& bounds);
/// "auto", "refit", "rebuild" or "every:K". The other arguments are those of Auto, and must have
/// their defaults with any other policy. Throws ValueError.
UpdatePolicy policy_of(const std::string& update, double budget_ms, double budget,
                       bool deterministic);
/// The values of the names that the documentation of Scene lists. Each throws ValueError.
Split split_of(const std::string& split);
Rays rays_named(const std::string& rays);
Shading shading_named(const std::string& shading);
Crossing crossing_named(const std::string& crossing);
FillRule rule_named(const std::string& rule);
Wrap wrap_named(const std::string& wrap);
/// "none", "sort", or the width of an image.
Coherence coherence_of(const py::object& coherence);
/// A number of the range of uint32.
std::uint32_t uint32_of(const py::handle& number, const std::string& name);

}  // namespace morphray::python
