// The parts that module.cpp puts together, and keyword arguments as options of C++.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <string>

#include "morphray/device.hpp"
#include "morphray/images.hpp"
#include "morphray/scene.hpp"

namespace morphray::python {

namespace py = pybind11;

class PyScene;

void bind_images(py::module_& module);
void bind_scene(py::module_& module);
void bind_queries(py::class_<PyScene>& scene_class);

/// Throws TypeError "`wanted` is needed, not ..." for what is no Value. That of pybind11, for
/// parameters of other types than object, lists those of all.
template <class Value>
Value value_of(const py::object& object, const char* wanted) {
    try {
        return object.cast<Value>();
    } catch (const py::cast_error&) {
        const std::string text = std::string(wanted) + " is needed, not ";
        throw py::type_error(text + std::string(py::repr(object)).substr(0, 60));
    }
}

/// A Device, or "cpu", "vulkan" or "brute".
Device device_of(const py::object& device);
/// "none", "sort", or the width of an image.
Coherence coherence_of(const py::object& coherence);
/// `update` is "auto", "refit", "rebuild" or "every:K", the others Auto's. Throws ValueError.
UpdatePolicy policy_of(const std::string& update, double budget_ms, double budget,
                       bool deterministic);
/// The values of the names that the documentation of Scene lists. Each throws ValueError.
Rays rays_named(const py::object& rays);
Shading shading_named(const py::object& shading);
Crossing crossing_named(const py::object& crossing);
FillRule rule_named(const py::object& rule);
Wrap wrap_named(const py::object& wrap);
Threads threads_named(const py::object& threads);

}  // namespace morphray::python
