#include "library/python/module/textures.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "morphray/error.hpp"

namespace morphray::python {
namespace {

std::string shape_text(const py::array& array) { return py::str(array.attr("shape")); }

template <class Number>
py::array_t<Number, py::array::c_style> require(const py::handle& object, const std::string& name,
                                                const char* dtype) {
    if (!py::isinstance<py::array_t<Number>>(object)) {
        throw py::type_error(name + ": a numpy.ndarray with dtype " + dtype + " is needed, not " +
                             std::string(py::str(py::type::handle_of(object).attr("__name__"))));
    }
    return py::array_t<Number, py::array::c_style>::ensure(object);
}

std::vector<std::uint32_t> texels_of(const py::array_t<std::uint8_t, py::array::c_style>& image,
                                     const std::string& name) {
    const bool fits = image.ndim() == 3 && (image.shape(2) == 3 || image.shape(2) == 4);
    if (!fits || image.shape(0) == 0 || image.shape(1) == 0) {
        throw py::value_error(name + ": a shape of (H, W, 3) or (H, W, 4) is needed, not " +
                              shape_text(image));
    }
    if (std::max(image.shape(0), image.shape(1)) > py::ssize_t{kMaxTextureSide}) {
        throw Error(ErrorCode::limit, name + ": a shape of " + shape_text(image) + "; at most " +
                                          std::to_string(kMaxTextureSide) +
                                          " texels a side are possible");
    }
    std::vector<std::uint32_t> texels(static_cast<std::size_t>(image.shape(0) * image.shape(1)));
    const std::uint8_t* from = image.data();
    for (std::uint32_t& texel : texels) {
        const std::uint32_t alpha = image.shape(2) == 4 ? from[3] : 255;
        texel = from[0] | std::uint32_t{from[1]} << 8 | std::uint32_t{from[2]} << 16 | alpha << 24;
        from += image.shape(2);
    }
    return texels;
}

template <class Index>
bool copy_ids(const py::object& object, const std::string& name, std::vector<std::uint32_t>& ids) {
    if (!py::isinstance<py::array_t<Index>>(object)) return false;
    const auto array = py::array_t<Index, py::array::c_style>::ensure(object);
    if (array.ndim() != 1)
        throw py::value_error(name + ": a shape of (T,) is needed, not " + shape_text(array));
    for (py::ssize_t i = 0; i < array.size(); ++i) {
        const Index id = array.data()[i];
        // -1 is INVALID_ID in a signed array.
        if (!std::in_range<std::uint32_t>(id) && id != static_cast<Index>(-1)) {
            throw Error(ErrorCode::bad_input,
                        name + ": " + std::to_string(id) + " of triangle " + std::to_string(i));
        }
        ids.push_back(static_cast<std::uint32_t>(id));
    }
    return true;
}

Wrap wrap_of(const py::object& wrap, const std::string& name) {
    if (!py::isinstance<py::str>(wrap)) throw py::type_error(name + ": a str is needed");
    const auto text = wrap.cast<std::string>();
    if (text == "repeat") return Wrap::repeat;
    if (text == "clamp") return Wrap::clamp;
    throw py::value_error(name + ": \"repeat\" or \"clamp\" is needed, not \"" + text + "\"");
}

float cutoff_of(const py::handle& number, const std::string& name) {
    try {
        return number.cast<float>();
    } catch (const py::cast_error&) {
        throw py::type_error(name + ": a number from 0 to 1 is needed, or a list of one an image");
    }
}

void set_cutoffs(const py::object& given, const std::string& name,
                 std::vector<TextureView>& views) {
    const bool is_list = py::isinstance<py::list>(given) || py::isinstance<py::tuple>(given);
    if (!is_list) {
        for (TextureView& view : views) view.alpha_cutoff = cutoff_of(given, name);
        return;
    }
    const auto list = py::reinterpret_borrow<py::sequence>(given);
    if (list.size() != views.size()) {
        throw py::value_error(name + ": " + std::to_string(list.size()) + " for " +
                              std::to_string(views.size()) + " images");
    }
    for (std::size_t i = 0; i < views.size(); ++i) views[i].alpha_cutoff = cutoff_of(list[i], name);
}

}  // namespace

MeshTextures textures_of(const py::object& textures, const std::string& name) {
    MeshTextures result;
    if (textures.is_none()) return result;
    if (!py::isinstance<py::tuple>(textures)) {
        throw py::type_error(name +
                             ": a morphray.Textures or a tuple (images, texcoords) is needed");
    }
    const auto parts = py::reinterpret_borrow<py::tuple>(textures);
    if (parts.size() < 2 || parts.size() > 5) {
        throw py::value_error(name +
                              ": 2 to 5 items are needed, (images, texcoords, ids, wrap, "
                              "alpha_cutoff), not " +
                              std::to_string(parts.size()));
    }
    const Wrap wrap = parts.size() > 3 ? wrap_of(parts[3], name + ": wrap") : Wrap::repeat;
    const bool is_list = py::isinstance<py::list>(parts[0]) || py::isinstance<py::tuple>(parts[0]);
    const py::object images = is_list ? py::object(parts[0]) : py::make_tuple(parts[0]);
    std::vector<std::vector<std::uint32_t>> texels;
    for (const py::handle item : images) {
        const std::string place =
            name + ": image" + (is_list ? " " + std::to_string(texels.size()) : "");
        const auto image = require<std::uint8_t>(item, place, "uint8");
        texels.push_back(texels_of(image, place));
        result.views.push_back({.width = static_cast<std::uint32_t>(image.shape(1)),
                                .height = static_cast<std::uint32_t>(image.shape(0)),
                                .wrap = wrap});
    }
    result.texels =
        std::make_shared<const std::vector<std::vector<std::uint32_t>>>(std::move(texels));
    for (std::size_t i = 0; i < result.views.size(); ++i)
        result.views[i].texels = (*result.texels)[i];
    if (result.views.empty()) throw py::value_error(name + ": no images");
    if (parts.size() > 4) set_cutoffs(parts[4], name + ": alpha_cutoff", result.views);

    const auto texcoords = require<float>(parts[1], name + ": texcoords", "float32");
    if (texcoords.ndim() != 3 || texcoords.shape(1) != 3 || texcoords.shape(2) != 2) {
        throw py::value_error(name + ": texcoords: a shape of (T, 3, 2) is needed, not " +
                              shape_text(texcoords));
    }
    result.texcoords.assign(texcoords.data(), texcoords.data() + texcoords.size());
    if (parts.size() < 3 || parts[2].is_none()) return result;
    const std::string ids = name + ": ids";
    if (!copy_ids<std::uint32_t>(parts[2], ids, result.ids) &&
        !copy_ids<std::int32_t>(parts[2], ids, result.ids) &&
        !copy_ids<std::uint64_t>(parts[2], ids, result.ids) &&
        !copy_ids<std::int64_t>(parts[2], ids, result.ids)) {
        throw py::type_error(ids + ": an array of uint32, int32, uint64 or int64 is needed");
    }
    return result;
}

}  // namespace morphray::python
