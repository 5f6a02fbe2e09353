#include "library/python/module/arrays.h"

#include <fmt/format.h>

#include <cstring>
#include <functional>

#include "library/python/module/module.h"

namespace morphray::python {
namespace {

using Shape = std::vector<py::ssize_t>;

std::string text_of(const py::handle& object) { return py::str(object); }

std::string text_of_shape(const py::array& array) { return text_of(array.attr("shape")); }

[[noreturn]] void throw_shape(const py::array& array, const std::string& name,
                              const std::string& wanted, const std::string& hint = {}) {
    throw py::value_error(fmt::format("{}: a shape of {} is needed, not {}{}", name, wanted,
                                      text_of_shape(array), hint));
}

/// Native byte order and, for structured types, equal names and offsets.
bool has_dtype(const py::array& array, const py::dtype& dtype) {
    return py::detail::npy_api::get().PyArray_EquivTypes_(array.dtype().ptr(), dtype.ptr());
}

bool is_closest(const py::array& array) {
    return has_dtype(array, dtypes().closest) || has_dtype(array, dtypes().far_closest);
}

template <class Number>
bool has_dtype(const py::array& array) {
    return has_dtype(array, py::dtype::of<Number>());
}

[[noreturn]] void throw_dtype(const py::array& array, const std::string& name,
                              const std::string& wanted) {
    throw py::type_error(name + ": dtype " + wanted + " in native byte order is needed, not " +
                         text_of(array.dtype().attr("str")) + "; astype() makes a copy");
}

/// Copies numbers to float32, less an origin in float64 from the first three on the last axis.
py::array floats_of(const py::array& array, const std::string& name, const Point& origin) {
    // Arrays with fewer columns are refused later.
    const bool is_moved =
        origin != Point{} && array.ndim() > 0 && array.shape(array.ndim() - 1) >= 3;
    if (!is_moved && has_dtype<float>(array)) return array;
    const char kind = array.dtype().kind();
    if (kind != 'f' && kind != 'i' && kind != 'u') throw_dtype(array, name, "float32");
    py::object numbers = array;
    if (is_moved) {
        numbers = array.attr("astype")(py::dtype::of<double>());
        const py::object points = numbers[py::make_tuple(py::ellipsis(), py::slice(0, 3, 1))];
        points.attr("__isub__")(py::array_t<double>(3, origin.data()));
    }
    return numbers.attr("astype")(py::dtype::of<float>());
}

/// numpy's own flag is set for any address of an array with fields.
bool is_aligned(const py::array& array, std::size_t alignment) {
    return reinterpret_cast<std::uintptr_t>(array.data()) % alignment == 0;
}

bool is_contiguous(const py::array& array) { return (array.flags() & py::array::c_style) != 0; }

py::array contiguous(const py::array& array, std::size_t alignment = alignof(float)) {
    if (is_contiguous(array) && is_aligned(array, alignment)) return array;
    return array.attr("copy")("C");
}

void require_rows_of_three(const py::array& array, const std::string& name, const char* rows) {
    if (array.ndim() == 2 && array.shape(1) == 3) return;
    const bool is_wide = *rows == 'V' && array.ndim() == 2 && array.shape(1) > 3;
    throw_shape(array, name, std::string("(") + rows + ", 3)",
                is_wide ? "; a slice [:, :3] is read in place" : "");
}

/// The numbers of an array that has `columns` of them for each triangle; -1 only if `may_be_none`.
std::vector<std::uint32_t> ids_of(const py::array& array, const std::string& name,
                                  std::size_t columns, const char* what, bool may_be_none) {
    if (array.size() == 0) return {};
    const bool is_signed = array.dtype().kind() == 'i';
    if (!is_signed && array.dtype().kind() != 'u')
        throw py::type_error(name + ": integers are needed, not " +
                             text_of(array.dtype().attr("str")) + "; astype() makes a copy");
    const py::dtype wide =
        is_signed ? py::dtype::of<std::int64_t>() : py::dtype::of<std::uint64_t>();
    const py::array packed = array.attr("astype")(wide, "C");
    const auto* const from = static_cast<const std::uint64_t*>(packed.data());
    std::vector<std::uint32_t> ids(static_cast<std::size_t>(packed.size()));
    for (std::size_t i = 0; i < ids.size(); ++i) {
        ids[i] = static_cast<std::uint32_t>(from[i]);
        if (from[i] == ids[i] || (may_be_none && from[i] == std::uint64_t(-1))) continue;
        const std::string number = is_signed ? std::to_string(static_cast<std::int64_t>(from[i]))
                                             : std::to_string(from[i]);
        throw Error(ErrorCode::bad_input,
                    fmt::format("{}: triangle {} has {} {}", name, i / columns, what, number));
    }
    return ids;
}

/// Colours of 3 or 4 bytes as numbers; `alpha` is that of those of 3.
std::vector<std::uint32_t> packed_colours(const py::array& array, std::uint32_t alpha) {
    const py::array packed = contiguous(array, 1);
    const py::ssize_t channels = packed.shape(packed.ndim() - 1);
    const auto* from = static_cast<const std::uint8_t*>(packed.data());
    std::vector<std::uint32_t> colours(static_cast<std::size_t>(packed.size() / channels));
    for (std::uint32_t& colour : colours) {
        if (channels == 4) alpha = from[3];
        colour = from[0] | std::uint32_t{from[1]} << 8 | std::uint32_t{from[2]} << 16 | alpha << 24;
        from += channels;
    }
    return colours;
}

Shape shape_of(const py::array& array) { return {array.shape(), array.shape() + array.ndim()}; }

/// The data of queries whose shape is known.
void read(const py::array& array, QueryArray& queries) {
    queries.count = 1;
    for (const py::ssize_t size : queries.shape) queries.count *= static_cast<std::size_t>(size);
    queries.array = contiguous(array);
}

bool is_list(const py::object& object) {
    return py::isinstance<py::list>(object) || py::isinstance<py::tuple>(object);
}

void set_cutoffs(const py::object& given, const std::string& name,
                 std::vector<TextureView>& views) {
    if (is_list(given) && py::len(given) != views.size())
        throw py::value_error(
            fmt::format("{}: {} for {} images", name, py::len(given), views.size()));
    const std::string wanted = name + ": a number from 0 to 1, or a list of one an image,";
    for (std::size_t i = 0; i < views.size(); ++i) {
        const py::object number = is_list(given) ? given[py::int_(i)] : given;
        views[i].alpha_cutoff = value_of<float>(number, wanted.c_str());
    }
}

/// Copies images, one or a list of them, and makes views of them.
void add_images(const py::object& given, const std::string& name, MeshTextures& textures) {
    const py::object images = is_list(given) ? given : py::make_tuple(given);
    for (const py::handle item : images) {
        std::string place = name + ": image";
        if (is_list(given)) place.append(" ").append(std::to_string(textures.texels.size()));
        const py::array image = array_of(py::reinterpret_borrow<py::object>(item), place);
        if (!has_dtype<std::uint8_t>(image)) throw_dtype(image, place, "uint8");
        const bool fits = image.ndim() == 3 && (image.shape(2) == 3 || image.shape(2) == 4);
        if (!fits || image.size() == 0) throw_shape(image, place, "(H, W, 3) or (H, W, 4)");
        textures.texels.push_back(packed_colours(image, 255));
        textures.views.push_back({.texels = textures.texels.back(),
                                  .width = static_cast<std::uint32_t>(image.shape(1)),
                                  .height = static_cast<std::uint32_t>(image.shape(0))});
    }
    if (textures.texels.empty()) throw py::value_error(name + ": no images");
}

}  // namespace

py::array array_of(const py::object& object, const std::string& name, py::ssize_t columns) {
    if (Py_TYPE(object.ptr()) == py::detail::npy_api::get().PyArray_Type_) return object;
    const py::module_ numpy = py::module_::import("numpy");
    if (py::hasattr(object, "mask") && py::cast<bool>(numpy.attr("ma").attr("is_masked")(object)))
        throw py::value_error(name + ": elements of the array are masked; filled() unmasks them");
    if (py::isinstance<py::array>(object)) return object;
    if (py::hasattr(object, "__dlpack__")) return numpy.attr("from_dlpack")(object);
    if (is_list(object) || py::hasattr(object, "__array__")) {
        const py::array array = numpy.attr("asarray")(object);
        const bool is_none = columns > 0 && array.ndim() == 1 && array.size() == 0;
        return is_none ? py::array(py::dtype::of<float>(), {py::ssize_t{0}, columns}) : array;
    }
    throw py::type_error(name + ": a numpy.ndarray is needed, not " +
                         text_of(py::type::handle_of(object).attr("__name__")));
}

Positions positions_of(const py::array& points, const std::string& name) {
    const bool has_doubles = has_dtype<double>(points);
    if (!has_doubles && !has_dtype<float>(points)) throw_dtype(points, name, "float32 or float64");
    require_rows_of_three(points, name, "V");
    const py::ssize_t size = points.itemsize();
    Positions positions{points.data(), static_cast<std::size_t>(points.shape(0)),
                        static_cast<std::size_t>(3 * size), has_doubles};
    if (positions.count == 0) return positions;
    const auto throw_strides = [&](const std::string& what) {
        throw py::value_error(
            fmt::format("{}: {}, but strides are {}; numpy.ascontiguousarray() makes a copy", name,
                        what, text_of(points.attr("strides"))));
    };
    if (points.strides(1) != size)
        throw_strides("the three numbers of a point must be next to each other");
    if (positions.count == 1) return positions;
    if (points.strides(0) < 3 * size)
        throw_strides(
            fmt::format("points must follow each other, {} bytes apart or more", 3 * size));
    positions.stride = static_cast<std::size_t>(points.strides(0));
    return positions;
}

std::vector<std::uint32_t> indices_of(const py::object& triangles, const std::string& name) {
    const py::array array = array_of(triangles, name, 3);
    require_rows_of_three(array, name, "T");
    return ids_of(array, name, 3, "vertex", false);
}

std::vector<MeshPose> poses_of(const py::object& poses, const py::object& geom_ids) {
    const py::array array = array_of(poses, "poses");
    if (array.ndim() != 3 || array.shape(1) != 3 || array.shape(2) != 4)
        throw_shape(array, "poses", "(n, 3, 4)");
    if (array.dtype().kind() != 'f') throw_dtype(array, "poses", "float32 or float64");
    const auto ids =
        value_of<std::vector<std::uint32_t>>(geom_ids, "geom_ids: whole numbers, one a pose,");
    if (static_cast<std::size_t>(array.shape(0)) != ids.size())
        throw py::value_error(fmt::format("geom_ids: {} for {} poses", ids.size(), array.shape(0)));
    const py::array_t<double, py::array::c_style | py::array::forcecast> numbers(array);
    std::vector<MeshPose> result(ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i) {
        result[i].geom_id = ids[i];
        std::memcpy(&result[i].transform.rows, numbers.data() + 12 * i, sizeof(Transform));
    }
    return result;
}

std::vector<std::uint32_t> albedo_of(const py::object& albedo, const std::string& name) {
    if (albedo.is_none()) return {};
    const py::array array = array_of(albedo, name);
    if (has_dtype<std::uint32_t>(array)) {
        if (array.ndim() != 1) throw_shape(array, name, "(T,)");
        return ids_of(array, name, 1, "colour", false);
    }
    if (!has_dtype<std::uint8_t>(array)) throw_dtype(array, name, "uint32 or uint8");
    if (array.ndim() != 2 || array.shape(1) != 3) throw_shape(array, name, "(T, 3)");
    return packed_colours(array, 0);
}

MeshTextures textures_of(const py::object& textures, const std::string& name) {
    MeshTextures result;
    if (textures.is_none()) return result;
    if (!py::isinstance<py::tuple>(textures))
        throw py::type_error(name +
                             ": a morphray.Textures or a tuple (images, texcoords) is needed");
    const py::tuple parts = py::module_::import("morphray")
                                .attr("Textures")(*py::reinterpret_borrow<py::tuple>(textures));
    add_images(parts[0], name, result);
    const py::array texcoords = array_of(parts[1], name + ": texcoords");
    if (!has_dtype<float>(texcoords)) throw_dtype(texcoords, name + ": texcoords", "float32");
    if (texcoords.ndim() != 3 || texcoords.shape(1) != 3 || texcoords.shape(2) != 2)
        throw_shape(texcoords, name + ": texcoords", "(T, 3, 2)");
    const py::array packed = contiguous(texcoords);
    const auto* const numbers = static_cast<const float*>(packed.data());
    result.texcoords.assign(numbers, numbers + packed.size());
    if (!parts[2].is_none()) {
        const py::array ids = array_of(parts[2], name + ": ids");
        if (ids.ndim() != 1) throw_shape(ids, name + ": ids", "(T,)");
        result.ids = ids_of(ids, name + ": ids", 1, "image", true);
    }
    const Wrap wrap = choice<Wrap>("wrap", parts[3], {"repeat", "clamp"});
    for (TextureView& view : result.views) view.wrap = wrap;
    set_cutoffs(parts[4], name + ": alpha_cutoff", result.views);
    return result;
}

QueryArray rays_of(const py::object& object, const Point& origin) {
    py::array array = array_of(object, "rays", 6);
    QueryArray rays{.name = "rays", .shape = shape_of(array)};
    if (has_dtype(array, dtypes().ray)) {
        if (origin != Point{}) {
            array = array.attr("copy")();
            array["org"] = floats_of(array["org"], "rays", origin);
        }
    } else {
        array = floats_of(array, "rays", origin);
        if (array.ndim() < 1 || (rays.shape.back() != 6 && rays.shape.back() != 8))
            throw_shape(array, "rays", "(N, 6) or (N, 8)");
        rays.shape.pop_back();
    }
    read(array, rays);
    if (rays.array.dtype().kind() != 'f' || array.shape(array.ndim() - 1) == 8) return rays;
    const auto* from = static_cast<const float*>(rays.array.data());
    py::array whole(dtypes().ray, rays.shape);
    for (Ray& ray : std::span(static_cast<Ray*>(whole.mutable_data()), rays.count)) {
        ray = {.org = {from[0], from[1], from[2]}, .dir = {from[3], from[4], from[5]}};
        from += 6;
    }
    rays.array = whole;
    return rays;
}

QueryArray query_points_of(const py::object& object, const Point& origin) {
    const py::array array = floats_of(array_of(object, "points", 3), "points", origin);
    QueryArray points{.name = "points", .shape = shape_of(array)};
    if (array.ndim() < 1 || points.shape.back() != 3) throw_shape(array, "points", "(N, 3)");
    points.shape.pop_back();
    read(array, points);
    return points;
}

std::optional<std::vector<Primitive>> excluded_of(const py::object& object,
                                                  const QueryArray& queries) {
    if (object.is_none()) return {};
    std::vector<Primitive> excluded;
    const py::array array = array_of(object, "excluded", 2);
    Shape shape = queries.shape;
    const std::string wanted = std::string("the ") + queries.name;
    if (has_dtype(array, dtypes().hit) || is_closest(array)) {
        if (shape_of(array) != shape) throw_shape(array, "excluded", wanted);
        const QueryArray hits = hit_array_of(array);
        for (const Hit& hit : hits.items<Hit>()) excluded.push_back(hit.primitive());
        return excluded;
    }
    shape.push_back(2);
    if (shape_of(array) != shape) throw_shape(array, "excluded", wanted + ", and 2");
    const std::vector<std::uint32_t> ids = ids_of(array, "excluded", 2, "an ID", true);
    for (std::size_t i = 0; i < queries.count; ++i)
        excluded.push_back({.prim_id = ids[2 * i + 1], .geom_id = ids[2 * i]});
    return excluded;
}

QueryArray hit_array_of(const py::object& object) {
    py::array array = array_of(object, "hits");
    if (is_closest(array)) {
        py::array hits(dtypes().hit, shape_of(array));
        for (const char* const name : {"u", "v", "prim_id", "geom_id"}) hits[name] = array[name];
        array = hits;
    } else if (!has_dtype(array, dtypes().hit)) {
        throw_dtype(array, "hits", "morphray.hit_dtype or morphray.closest_dtype");
    }
    QueryArray hits{.name = "hits", .shape = shape_of(array)};
    read(array, hits);
    return hits;
}

std::optional<std::vector<std::uint8_t>> visible_of(const py::object& object) {
    if (object.is_none()) return {};
    const py::array array = array_of(object, "visible");
    // [] is an array of float64.
    if (array.size() > 0 && !has_dtype<bool>(array)) throw_dtype(array, "visible", "bool");
    if (array.ndim() != 1) throw_shape(array, "visible", "(G,)");
    const py::array packed = contiguous(array, 1);
    const auto* const flags = static_cast<const std::uint8_t*>(packed.data());
    return std::vector<std::uint8_t>(flags, flags + packed.size());
}

std::optional<std::vector<std::uint32_t>> geom_ids_of(const py::object& ids, const char* name) {
    if (ids.is_none()) return {};
    const py::array array = array_of(ids, name);
    if (array.ndim() != 1) throw_shape(array, name, "(G,)");
    return ids_of(array, name, 1, "the geom_id", false);
}

py::array results_for(const QueryArray& queries, const py::object& out, const py::dtype& dtype) {
    if (out.is_none()) return py::array(dtype, queries.shape);
    if (is_list(out)) throw py::type_error("out: a numpy.ndarray is needed, not a list");
    py::array array = array_of(out, "out");
    if (!has_dtype(array, dtype))
        throw py::type_error(
            fmt::format("out: dtype {} is needed, not {}", text_of(dtype), text_of(array.dtype())));
    if (shape_of(array) != queries.shape)
        throw py::value_error(fmt::format("out: a shape of {} is needed, as the {} have, not {}",
                                          text_of(py::tuple(py::cast(queries.shape))), queries.name,
                                          text_of_shape(array)));
    if (!array.writeable()) throw py::value_error("out: the array is read-only");
    // The alignment of bools, of numbers of 8 bytes, or of the 4-byte numbers in fields.
    const std::size_t alignment = dtype.itemsize() == 1 ? 1 : dtype.itemsize() == 8 ? 8 : 4;
    if (!is_contiguous(array) || !is_aligned(array, alignment))
        throw py::value_error(
            fmt::format("out: the array must be C-contiguous and aligned to {} bytes", alignment));
    const auto* const begin = static_cast<const char*>(array.data());
    const auto* const first = static_cast<const char*>(queries.array.data());
    if (std::less<>()(begin, first + queries.array.nbytes()) &&
        std::less<>()(first, begin + array.nbytes()))
        throw py::value_error(std::string("out: the array shares memory with the ") + queries.name);
    return array;
}

}  // namespace morphray::python
