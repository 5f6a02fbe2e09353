#include "scenes/gltf/accessor.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

#include "common/text/text_parts.h"

namespace mray::gltf {
namespace {

constexpr std::uint64_t kMaxElements = 0xFFFFFFFEu;

std::size_t size_of(Component component) {
    switch (component) {
        case Component::kInt8:
        case Component::kUint8:
            return 1;
        case Component::kInt16:
        case Component::kUint16:
            return 2;
        default:
            return 4;
    }
}

Component component_of(const JsonAt& at) {
    const std::uint64_t value = at.count();
    for (const Component component : {Component::kInt8, Component::kUint8, Component::kInt16,
                                      Component::kUint16, Component::kUint32, Component::kFloat}) {
        if (value == static_cast<std::uint64_t>(component)) return component;
    }
    at.fail(fmt::format("is {}; must be 5120, 5121, 5122, 5123, 5125 or 5126", value));
}

std::size_t width_of(const JsonAt& at) {
    constexpr std::array<std::pair<std::string_view, std::size_t>, 7> kTypes = {{{"SCALAR", 1},
                                                                                 {"VEC2", 2},
                                                                                 {"VEC3", 3},
                                                                                 {"VEC4", 4},
                                                                                 {"MAT2", 4},
                                                                                 {"MAT3", 9},
                                                                                 {"MAT4", 16}}};
    for (const auto& [name, width] : kTypes)
        if (at.text() == name) return width;
    at.fail(fmt::format("is {}; must be SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4",
                        quote(at.text())));
}

/// A component as the number it stands for.
template <bool kNormalized, class T>
float number_of(T value) {
    if constexpr (std::is_same_v<T, float> || !kNormalized) {
        return static_cast<float>(value);
    } else {
        const float scaled =
            static_cast<float>(value) / static_cast<float>(std::numeric_limits<T>::max());
        return std::max(scaled, -1.0f);
    }
}

/// Calls convert(value) for each component of `count` elements, and writes the results to `out`.
template <class T, class Out, class Convert>
void convert_components(const PackedArray& array, std::size_t count, std::size_t width, Out* out,
                        Convert convert) {
    for (std::size_t i = 0; i < count; ++i) {
        const char* const element = array.bytes.data() + i * array.stride;
        for (std::size_t k = 0; k < width; ++k) {
            T value;
            std::memcpy(&value, element + k * sizeof(T), sizeof value);
            *out++ = convert(value);
        }
    }
}

template <class T>
void read_as(const PackedArray& array, std::size_t count, std::size_t width, bool normalized,
             float* out) {
    if (normalized) {
        convert_components<T>(array, count, width, out, number_of<true, T>);
    } else {
        convert_components<T>(array, count, width, out, number_of<false, T>);
    }
}

void read_floats(const PackedArray& array, std::size_t count, std::size_t width, bool normalized,
                 float* out) {
    switch (array.component) {
        case Component::kInt8:
            return read_as<std::int8_t>(array, count, width, normalized, out);
        case Component::kUint8:
            return read_as<std::uint8_t>(array, count, width, normalized, out);
        case Component::kInt16:
            return read_as<std::int16_t>(array, count, width, normalized, out);
        case Component::kUint16:
            return read_as<std::uint16_t>(array, count, width, normalized, out);
        case Component::kUint32:
            return read_as<std::uint32_t>(array, count, width, normalized, out);
        default:
            return read_as<float>(array, count, width, false, out);
    }
}

void read_integers(const PackedArray& array, std::size_t count, std::size_t width,
                   std::uint32_t* out) {
    const auto widen = [](auto value) { return static_cast<std::uint32_t>(value); };
    switch (array.component) {
        case Component::kUint8:
            return convert_components<std::uint8_t>(array, count, width, out, widen);
        case Component::kUint16:
            return convert_components<std::uint16_t>(array, count, width, out, widen);
        default:
            return convert_components<std::uint32_t>(array, count, width, out, widen);
    }
}

bool is_unsigned(Component component, bool allow_32_bits) {
    return component == Component::kUint8 || component == Component::kUint16 ||
           (allow_32_bits && component == Component::kUint32);
}

void require(const Accessor& accessor, const Wanted& wanted) {
    if (accessor.width != wanted.width)
        accessor.at.at("type").fail(fmt::format("must be {} here", wanted.type));
    const Component component = accessor.base.component;
    if (component == Component::kFloat) return;
    const bool is_allowed =
        component != Component::kUint32 &&
        (wanted.integers == Wanted::Integers::kAny ||
         (wanted.integers == Wanted::Integers::kNormalized && accessor.normalized));
    if (is_allowed) return;
    accessor.at.at("componentType")
        .fail(fmt::format("must be 5126 (float){} here",
                          wanted.integers == Wanted::Integers::kNone
                              ? ""
                              : " or an integer of 8 or 16 bits that is normalized"));
}

}  // namespace

Accessors::Accessors(const GltfFile& file) : file_(file), view_count_(file.count("bufferViews")) {}

Accessors::View Accessors::view_of(const JsonAt& view) {
    const std::size_t buffer = view.at("buffer").index_below(file_.buffers().size(), "buffers");
    const std::uint64_t offset = view.count_or("byteOffset", 0);
    const std::uint64_t length = view.at("byteLength").count();
    const std::string_view bytes = file_.buffers()[buffer].bytes;
    if (length > bytes.size() || offset > bytes.size() - length) {
        view.at("byteLength")
            .fail(fmt::format("bytes {} to {} are not in the buffer, which has {}", offset,
                              offset + length, bytes.size()));
    }
    return {bytes.substr(offset, length), offset};
}

PackedArray Accessors::packed(const JsonAt& owner, std::size_t view_index, std::uint64_t offset,
                              Component component, std::size_t width, std::size_t count,
                              bool may_have_stride) {
    const JsonAt view = file_.element("bufferViews", view_index);
    const auto [bytes, view_offset] = view_of(view);
    const std::size_t element = width * size_of(component);
    std::uint64_t stride = element;
    if (const std::optional<JsonAt> given = view.find("byteStride"); given && may_have_stride) {
        stride = given->count();
        if (stride < element || stride > 252 || stride % size_of(component) != 0)
            given->fail(fmt::format("is {}; elements have {} bytes", stride, element));
    }
    if ((view_offset + offset) % size_of(component) != 0) {
        owner.fail(
            fmt::format("begins at byte {} of its buffer, which is no multiple of the {} "
                        "bytes of a component",
                        view_offset + offset, size_of(component)));
    }
    // count < 2^32 and stride <= 252, so that nothing overflows.
    const std::uint64_t needed = count == 0 ? 0 : stride * (count - 1) + element;
    if (needed > bytes.size() || offset > bytes.size() - needed) {
        owner.fail(fmt::format("bytes {} to {} are not in bufferViews[{}], which has {}", offset,
                               offset + needed, view_index, bytes.size()));
    }
    return {bytes.substr(offset, needed), stride, component};
}

Accessor Accessors::open(const JsonAt& reference) {
    const std::size_t index = reference.index_below(file_.count("accessors"), "accessors");
    const JsonAt at = file_.element("accessors", index);
    Accessor accessor{.at = at};
    const std::uint64_t count = at.at("count").count();
    if (count == 0 || count > kMaxElements)
        at.at("count").fail(fmt::format("is {}; must be from 1 to {}", count, kMaxElements));
    accessor.count = count;
    accessor.width = width_of(at.at("type"));
    const Component component = component_of(at.at("componentType"));
    accessor.base.component = component;
    if (const auto normalized = at.find("normalized")) accessor.normalized = normalized->boolean();
    if (const auto view = at.index_or_none("bufferView", view_count_, "buffer views")) {
        accessor.base = packed(at, *view, at.count_or("byteOffset", 0), component, accessor.width,
                               accessor.count, true);
    } else if (count > file_.buffer_bytes()) {
        at.at("count").fail(
            fmt::format("is {}, but the accessor has no bufferView, and all buffers have {} bytes",
                        count, file_.buffer_bytes()));
    }
    if (const auto sparse = at.find("sparse")) open_sparse(*sparse, component, accessor);
    return accessor;
}

void Accessors::open_sparse(const JsonAt& sparse, Component component, Accessor& accessor) {
    const std::uint64_t count = sparse.at("count").count();
    if (count == 0 || count > accessor.count) {
        sparse.at("count").fail(fmt::format("is {}; must be from 1 to {}", count, accessor.count));
    }
    accessor.sparse_count = count;
    const JsonAt indices = sparse.at("indices");
    const Component index_component = component_of(indices.at("componentType"));
    if (!is_unsigned(index_component, true))
        indices.at("componentType").fail("must be 5121, 5123 or 5125 here");
    accessor.sparse_indices =
        packed(indices, indices.at("bufferView").index_below(view_count_, "buffer views"),
               indices.count_or("byteOffset", 0), index_component, 1, count, false);
    const JsonAt values = sparse.at("values");
    accessor.sparse_values =
        packed(values, values.at("bufferView").index_below(view_count_, "buffer views"),
               values.count_or("byteOffset", 0), component, accessor.width, count, false);
}

std::vector<std::uint32_t> Accessors::sparse_indices(const Accessor& accessor) {
    std::vector<std::uint32_t> indices(accessor.sparse_count);
    read_integers(accessor.sparse_indices, indices.size(), 1, indices.data());
    for (std::size_t i = 0; i < indices.size(); ++i) {
        if (indices[i] < accessor.count && (i == 0 || indices[i] > indices[i - 1])) continue;
        accessor.at.at("sparse").at("indices").fail(fmt::format(
            "index {} is {}; they must increase and stay below {}", i, indices[i], accessor.count));
    }
    return indices;
}

std::vector<float> Accessors::floats(const Accessor& accessor, const Wanted& wanted) {
    require(accessor, wanted);
    const std::size_t width = accessor.width;
    std::vector<float> values(accessor.count * width);
    if (!accessor.base.bytes.empty()) {
        read_floats(accessor.base, accessor.count, width, accessor.normalized, values.data());
    }
    if (accessor.sparse_count == 0) return values;
    const SparseFloats sparse = sparse_floats(accessor, wanted);
    for (std::size_t i = 0; i < sparse.indices.size(); ++i)
        std::copy_n(&sparse.values[i * width], width, &values[sparse.indices[i] * width]);
    return values;
}

SparseFloats Accessors::sparse_floats(const Accessor& accessor, const Wanted& wanted) {
    require(accessor, wanted);
    SparseFloats sparse;
    if (accessor.sparse_count == 0) return sparse;
    sparse.indices = sparse_indices(accessor);
    sparse.values.resize(accessor.sparse_count * accessor.width);
    read_floats(accessor.sparse_values, accessor.sparse_count, accessor.width, accessor.normalized,
                sparse.values.data());
    return sparse;
}

std::vector<std::uint32_t> Accessors::integers(const Accessor& accessor, std::size_t width,
                                               bool allow_32_bits) {
    if (accessor.width != width)
        accessor.at.at("type").fail(fmt::format("must be {} here", width == 1 ? "SCALAR" : "VEC4"));
    if (!is_unsigned(accessor.base.component, allow_32_bits) || accessor.normalized) {
        accessor.at.at("componentType")
            .fail(fmt::format("must be 5121 or 5123{} here, and not normalized",
                              allow_32_bits ? " or 5125" : ""));
    }
    std::vector<std::uint32_t> values(accessor.count * width);
    if (!accessor.base.bytes.empty())
        read_integers(accessor.base, accessor.count, width, values.data());
    if (accessor.sparse_count == 0) return values;
    const std::vector<std::uint32_t> indices = sparse_indices(accessor);
    std::vector<std::uint32_t> replaced(accessor.sparse_count * width);
    read_integers(accessor.sparse_values, accessor.sparse_count, width, replaced.data());
    for (std::size_t i = 0; i < indices.size(); ++i)
        std::copy_n(&replaced[i * width], width, &values[indices[i] * width]);
    return values;
}

}  // namespace mray::gltf
