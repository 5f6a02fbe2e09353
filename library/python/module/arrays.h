// The caller's numpy arrays: checked, then read and written in place.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <optional>
#include <vector>

#include "morphray/mesh.hpp"

namespace morphray::python {

namespace py = pybind11;

/// The structured dtypes of arrays of Ray, Hit and ClosestPoint; `feature` of the last is a uint32.
struct Dtypes {
    py::dtype ray, hit, closest;
    /// `closest` with a float64 `point`, for scenes with an origin.
    py::dtype far_closest;
};
const Dtypes& dtypes();

/// An array, a view of what has __dlpack__, or a new array of what has __array__, a list or a
/// tuple; an empty one has the shape (0, columns). Throws TypeError; ValueError for masked
/// elements.
py::array array_of(const py::object& object, const std::string& name, py::ssize_t columns = 0);

/// An array of shape (V, 3) of float32 or float64. Throws TypeError, ValueError.
Positions positions_of(const py::array& points, const std::string& name);

/// The indices of an array of shape (T, 3) of uint32, int32, int64 or uint64, copied. Throws
/// TypeError, ValueError, and Error(bad_input) for an index that is negative or above 2^32 - 1.
std::vector<std::uint32_t> indices_of(const py::object& triangles, const std::string& name);

/// The colours of an array of shape (T,) of uint32, or (T, 3) of uint8. None: no colours.
std::vector<std::uint32_t> albedo_of(const py::object& albedo, const std::string& name);

/// Poses of an array of shape (n, 3, 4) of numbers, and of n geom_ids. Throws TypeError,
/// ValueError.
std::vector<MeshPose> poses_of(const py::object& poses, const py::object& geom_ids);

struct MeshTextures {
    std::vector<std::vector<std::uint32_t>> texels;
    /// Views of `texels`.
    std::vector<TextureView> views;
    std::vector<float> texcoords;
    std::vector<std::uint32_t> ids;
};

/// Reads a morphray.Textures, or a tuple (images, texcoords[, ids[, wrap[, alpha_cutoff]]]).
/// Throws TypeError, ValueError, and Error(bad_input) for an id that is no uint32.
MeshTextures textures_of(const py::object& textures, const std::string& name);

/// Rays, points or hits of the caller, one after the other.
struct QueryArray {
    const char* name = "";
    py::array array = {};
    std::size_t count = 0;
    /// The shape of the results.
    std::vector<py::ssize_t> shape;

    /// As Ray, Vec3 or Hit, which are laid out as the floats of the array.
    template <class Item>
    std::span<const Item> items() const {
        return {reinterpret_cast<const Item*>(array.data()), count};
    }
};

/// An array of shape (..., 6) or (..., 8) of numbers, or of any shape of dtypes().ray: in place if
/// it is float32, C-contiguous and aligned, and the origin is 0; else copied, less the origin, and
/// so are those of shape (..., 6).
QueryArray rays_of(const py::object& rays, const Point& origin);
/// An array of shape (..., 3) of numbers, read or copied as rays are.
QueryArray query_points_of(const py::object& points, const Point& origin);
/// The triangles that queries leave out: an array of hit_dtype or one of closest points with the
/// shape of the queries, or of (..., 2) integers, geom_id and prim_id. None: nothing.
std::optional<std::vector<Primitive>> excluded_of(const py::object& excluded,
                                                  const QueryArray& queries);
/// Hits of an array of hit_dtype, or made of one of closest points, read or copied as rays are.
QueryArray hit_array_of(const py::object& hits);
/// Flags of an array of bool, by geom_id. None: nothing.
std::optional<std::vector<std::uint8_t>> visible_of(const py::object& visible);
/// An array of integers. None: nothing.
std::optional<std::vector<std::uint32_t>> geom_ids_of(const py::object& ids, const char* name);

/// `out`, if writable, C-contiguous and of this dtype and shape; a new array if it is None.
py::array results_for(const QueryArray& queries, const py::object& out, const py::dtype& dtype);

}  // namespace morphray::python
