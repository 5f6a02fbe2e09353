#include "library/python/module/arrays.h"

#include <pybind11/eval.h>
#include <pybind11/stl.h>

#include <utility>

#include "morphray/error.hpp"

namespace morphray::python {
namespace {

using Shape = std::vector<py::ssize_t>;

std::string text_of(const py::handle& object) { return py::str(object); }

std::string type_of(const py::handle& object) {
    return py::str(py::type::handle_of(object).attr("__name__"));
}

std::string text_of_shape(const py::array& array) { return text_of(array.attr("shape")); }

/// Native byte order and, for structured types, equal names and offsets.
bool has_dtype(const py::array& array, const py::dtype& dtype) {
    return py::detail::npy_api::get().PyArray_EquivTypes_(array.dtype().ptr(), dtype.ptr());
}

template <class Number>
bool has_dtype(const py::array& array) {
    return has_dtype(array, py::dtype::of<Number>());
}

py::array require_array(const py::object& object, const std::string& name) {
    if (!py::isinstance<py::array>(object))
        throw py::type_error(name + ": a numpy.ndarray is needed, not " + type_of(object));
    return py::reinterpret_borrow<py::array>(object);
}

[[noreturn]] void throw_dtype(const py::array& array, const std::string& name,
                              const std::string& wanted) {
    throw py::type_error(name + ": dtype " + wanted + " in native byte order is needed, not " +
                         text_of(array.dtype().attr("str")) + "; astype() makes a copy");
}

/// Whether numbers of this alignment can be read from here on. numpy's own flag is set for any
/// address of an array with fields.
bool is_aligned(const py::array& array, std::size_t alignment) {
    return reinterpret_cast<std::uintptr_t>(array.data()) % alignment == 0;
}

bool is_contiguous(const py::array& array) { return (array.flags() & py::array::c_style) != 0; }

py::array contiguous(const py::array& array, std::size_t alignment = alignof(float)) {
    if (is_contiguous(array) && is_aligned(array, alignment)) return array;
    return array.attr("copy")("C");
}

/// Rows of three numbers.
void require_rows_of_three(const py::array& array, const std::string& name, const char* rows) {
    if (array.ndim() == 2 && array.shape(1) == 3) return;
    std::string message =
        name + ": a shape of (" + rows + ", 3) is needed, not " + text_of_shape(array);
    if (array.ndim() == 2 && array.shape(1) > 3) message += "; a slice [:, :3] is read in place";
    throw py::value_error(message);
}

template <class Index>
std::vector<std::uint32_t> copy_indices(const py::array& triangles, const std::string& name) {
    const py::array packed = contiguous(triangles, alignof(Index));
    const auto* const from = static_cast<const Index*>(packed.data());
    std::vector<std::uint32_t> indices(static_cast<std::size_t>(packed.size()));
    for (std::size_t i = 0; i < indices.size(); ++i) {
        if (!std::in_range<std::uint32_t>(from[i])) {
            throw Error(ErrorCode::bad_input, name + ": triangle " + std::to_string(i / 3) +
                                                  " has vertex " + std::to_string(from[i]));
        }
        indices[i] = static_cast<std::uint32_t>(from[i]);
    }
    return indices;
}

py::dtype dtype_of(const char* fields) {
    const py::module_ numpy = py::module_::import("numpy");
    return py::reinterpret_borrow<py::dtype>(numpy.attr("dtype")(py::eval(fields)));
}

Shape shape_of(const py::array& array) { return {array.shape(), array.shape() + array.ndim()}; }

/// The data of queries whose shape is known.
void read(const py::array& array, QueryArray& queries) {
    queries.count = 1;
    for (const py::ssize_t size : queries.shape) queries.count *= static_cast<std::size_t>(size);
    const py::array packed = contiguous(array);
    queries.array = packed;
    queries.data = static_cast<const float*>(packed.data());
}

std::pair<std::uintptr_t, std::uintptr_t> bytes_of(const void* data, std::size_t size) {
    const auto begin = reinterpret_cast<std::uintptr_t>(data);
    return {begin, begin + size};
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
    static const auto* const dtype = new py::dtype(
        dtype_of("[('point', 'f4', (3,)), ('distance', 'f4'), ('u', 'f4'), ('v', 'f4'), "
                 "('prim_id', 'u4'), ('geom_id', 'u4'), ('feature', 'u4')]"));
    return *dtype;
}

py::array points_array(const py::object& points, const std::string& name) {
    py::array array = require_array(points, name);
    if (!has_dtype<float>(array)) throw_dtype(array, name, "float32");
    require_rows_of_three(array, name, "V");
    return array;
}

Positions positions_of(const py::array& points, const std::string& name) {
    Positions positions{points.data(), static_cast<std::size_t>(points.shape(0)), sizeof(Vec3)};
    if (positions.count == 0) return positions;
    if (points.strides(1) != sizeof(float)) {
        throw py::value_error(
            name + ": the three numbers of a point must be next to each other, but strides are " +
            text_of(points.attr("strides")) + "; numpy.ascontiguousarray() makes a copy");
    }
    if (positions.count == 1) return positions;
    if (points.strides(0) < static_cast<py::ssize_t>(sizeof(Vec3))) {
        throw py::value_error(name + ": points must follow each other, 12 bytes apart or more, " +
                              "but strides are " + text_of(points.attr("strides")) +
                              "; numpy.ascontiguousarray() makes a copy");
    }
    positions.stride = static_cast<std::size_t>(points.strides(0));
    return positions;
}

std::vector<std::uint32_t> indices_of(const py::object& triangles, const std::string& name) {
    const py::array array = require_array(triangles, name);
    require_rows_of_three(array, name, "T");
    if (has_dtype<std::uint32_t>(array)) return copy_indices<std::uint32_t>(array, name);
    if (has_dtype<std::int32_t>(array)) return copy_indices<std::int32_t>(array, name);
    if (has_dtype<std::int64_t>(array)) return copy_indices<std::int64_t>(array, name);
    if (has_dtype<std::uint64_t>(array)) return copy_indices<std::uint64_t>(array, name);
    throw_dtype(array, name, "uint32, int32, uint64 or int64");
}

std::vector<std::uint32_t> albedo_of(const py::object& albedo, const std::string& name) {
    if (albedo.is_none()) return {};
    const py::array array = require_array(albedo, name);
    const bool is_packed = has_dtype<std::uint32_t>(array);
    if (!is_packed && !has_dtype<std::uint8_t>(array)) throw_dtype(array, name, "uint32 or uint8");
    if (is_packed ? array.ndim() != 1 : array.ndim() != 2 || array.shape(1) != 3) {
        throw py::value_error(name + ": a shape of " + (is_packed ? "(T,)" : "(T, 3)") +
                              " is needed, not " + text_of_shape(array));
    }
    const py::array packed = contiguous(array);
    std::vector<std::uint32_t> colours(static_cast<std::size_t>(packed.shape(0)));
    if (is_packed) {
        const auto* const from = static_cast<const std::uint32_t*>(packed.data());
        colours.assign(from, from + colours.size());
    } else {
        const auto* from = static_cast<const std::uint8_t*>(packed.data());
        for (std::uint32_t& colour : colours) {
            colour = from[0] | std::uint32_t{from[1]} << 8 | std::uint32_t{from[2]} << 16;
            from += 3;
        }
    }
    return colours;
}

QueryArray rays_of(const py::object& object) {
    const py::array array = require_array(object, "rays");
    QueryArray rays{.name = "rays", .shape = shape_of(array)};
    if (!has_dtype(array, ray_dtype())) {
        if (!has_dtype<float>(array)) throw_dtype(array, "rays", "float32 or morphray.ray_dtype");
        if (array.ndim() < 2 || (rays.shape.back() != 6 && rays.shape.back() != 8)) {
            throw py::value_error("rays: a shape of (N, 6) or (N, 8) is needed, not " +
                                  text_of_shape(array));
        }
        rays.columns = static_cast<std::size_t>(rays.shape.back());
        rays.shape.pop_back();
    }
    read(array, rays);
    return rays;
}

QueryArray query_points_of(const py::object& object) {
    const py::array array = require_array(object, "points");
    QueryArray points{.name = "points", .columns = 3, .shape = shape_of(array)};
    if (!has_dtype<float>(array)) throw_dtype(array, "points", "float32");
    if (array.ndim() < 2 || points.shape.back() != 3)
        throw py::value_error("points: a shape of (N, 3) is needed, not " + text_of_shape(array));
    points.shape.pop_back();
    read(array, points);
    return points;
}

py::array results_for(const QueryArray& queries, const py::object& out, const py::dtype& dtype) {
    if (out.is_none()) return py::array(dtype, queries.shape);
    py::array array = require_array(out, "out");
    if (!has_dtype(array, dtype)) {
        throw py::type_error("out: dtype " + text_of(dtype) + " is needed, not " +
                             text_of(array.dtype()));
    }
    if (shape_of(array) != queries.shape) {
        throw py::value_error("out: a shape of " + text_of(py::tuple(py::cast(queries.shape))) +
                              " is needed, as the " + queries.name + " have, not " +
                              text_of_shape(array));
    }
    if (!array.writeable()) throw py::value_error("out: the array is read-only");
    // That of the bools, the numbers of 8 bytes, or the 4-byte numbers in fields.
    const std::size_t alignment = dtype.itemsize() == 1 ? 1 : dtype.itemsize() == 8 ? 8 : 4;
    if (!is_contiguous(array) || !is_aligned(array, alignment)) {
        throw py::value_error("out: the array must be C-contiguous and aligned to " +
                              std::to_string(alignment) + " bytes");
    }
    const auto [begin, end] = bytes_of(array.data(), static_cast<std::size_t>(array.nbytes()));
    const auto [first, last] =
        bytes_of(queries.data, queries.count * queries.columns * sizeof(float));
    if (begin < last && first < end) {
        throw py::value_error(std::string("out: the array shares memory with the ") + queries.name);
    }
    return array;
}

}  // namespace morphray::python
