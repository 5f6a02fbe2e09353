// Textures as Python objects have them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <pybind11/numpy.h>

#include "morphray/mesh.hpp"

namespace morphray::python {

namespace py = pybind11;

/// The textures of a mesh, copied from arrays.
struct MeshTextures {
    std::shared_ptr<const std::vector<std::vector<std::uint32_t>>> texels;
    /// Views of `texels`, which copies share.
    std::vector<TextureView> views;
    std::vector<float> texcoords;
    std::vector<std::uint32_t> ids;
};

/// The fields of morphray.Textures, or of a tuple (images, texcoords[, ids[, wrap[,
/// alpha_cutoff]]]). None: no textures. Throws TypeError, ValueError, and Error(bad_input) for an
/// id that is no uint32.
MeshTextures textures_of(const py::object& textures, const std::string& name);

}  // namespace morphray::python
