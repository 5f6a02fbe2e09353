// The keyword arguments of Scene and Scene.render() as options of C++.
#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include "morphray/image.hpp"
#include "morphray/scene.hpp"

namespace morphray::python {

namespace py = pybind11;

/// "auto", "refit", "rebuild" or "every:K". The other arguments are those of Auto, and must have
/// their defaults with any other policy. Throws ValueError.
UpdatePolicy policy_of(const std::string& update, double budget_ms, double budget,
                       bool deterministic);
/// "binned" or "sweep".
Split split_of(const std::string& split);
/// None, or a lower and an upper point.
std::optional<Box> bounds_of(const py::object& bounds);
/// "primary", "shadow" or "ao".
Rays rays_named(const std::string& rays);
Shading shading_named(const std::string& shading);
/// "owner" or "each".
Crossing crossing_named(const std::string& crossing);
/// "none", "sort", or the width of an image.
Coherence coherence_of(const py::object& coherence);
/// "nonzero" or "odd".
FillRule rule_named(const std::string& rule);
/// A number of the range of uint32.
std::uint32_t uint32_of(const py::handle& number, const std::string& name);

}  // namespace morphray::python
