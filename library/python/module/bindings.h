// The parts that module.cpp puts together, and keyword arguments as options of C++.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <string>
#include <variant>

#include "morphray/device.hpp"
#include "morphray/images.hpp"
#include "morphray/scene.hpp"

namespace morphray::python {

namespace py = pybind11;

class PyScene;

void bind_images(py::module_& module);
void bind_scene(py::module_& module);
void bind_queries(py::class_<PyScene>& scene_class);

/// A Device, or "cpu", "vulkan" or "brute".
using AnyDevice = std::variant<std::string, Device>;
Device device_of(const AnyDevice& device, const std::string& name);
/// "none", "sort", or the width of an image.
using AnyCoherence = std::variant<std::string, std::uint32_t>;
Coherence coherence_of(const AnyCoherence& coherence);
/// `update` is "auto", "refit", "rebuild" or "every:K", the others Auto's. Throws ValueError.
UpdatePolicy policy_of(const std::string& update, double budget_ms, double budget,
                       bool deterministic);
/// The values of the names that the documentation of Scene lists. Each throws ValueError.
Rays rays_named(const std::string& rays);
Shading shading_named(const std::string& shading);
Crossing crossing_named(const std::string& crossing);
FillRule rule_named(const std::string& rule);
Wrap wrap_named(const std::string& wrap);
Threads threads_named(const std::string& threads);

}  // namespace morphray::python
