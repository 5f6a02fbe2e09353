#include "scenes/gltf/gltf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

#include "common/text/text_parts.h"

namespace mray::gltf {
namespace {

constexpr std::uint64_t kMaxElements = 0xFFFFFFFEu;

/// The types of components, by their numbers in the file.
enum class Component : std::uint16_t {
    kInt8 = 5120,
    kUint8 = 5121,
    kInt16 = 5122,
    kUint16 = 5123,
    kUint32 = 5125,
    kFloat = 5126
};

/// A part of a buffer view. Empty bytes stand for zeros.
struct PackedArray {
    std::string_view bytes;
    std::size_t stride = 0;
    Component component = Component::kFloat;
};

/// An accessor whose members have been checked against each other, its buffer view and its buffer.
struct Accessor {
    JsonAt at;
    std::size_t count = 0;
    std::size_t width = 1;
    bool normalized = false;
    PackedArray base = {};
    /// Elements that replace those of `base`, and their indices.
    std::size_t sparse_count = 0;
    PackedArray sparse_indices = {};
    PackedArray sparse_values = {};
};

constexpr std::pair<std::string_view, std::size_t> kTypes[] = {
    {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};

std::size_t size_of(Component component) {
    return component <= Component::kUint8 ? 1 : component <= Component::kUint16 ? 2 : 4;
}

Component component_of(const JsonAt& at) {
    const std::uint64_t value = at.count();
    if (value < 5120 || value > 5126 || value == 5124)
        at.fail("is {}; must be 5120, 5121, 5122, 5123, 5125 or 5126", value);
    return static_cast<Component>(value);
}

std::size_t width_of(const JsonAt& at) {
    for (const auto& [name, width] : kTypes)
        if (at.text() == name) return width;
    at.fail("is {}; must be SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4", quote(at.text()));
}

/// A component as the number it stands for.
template <class Number, class T>
Number number_of(T value, bool normalized) {
    if constexpr (std::is_same_v<Number, T> || !std::is_same_v<Number, float>) {
        return static_cast<Number>(value);
    } else {
        if (!normalized) return static_cast<float>(value);
        constexpr auto kMost = static_cast<float>(std::numeric_limits<T>::max());
        return std::max(static_cast<float>(value) / kMost, -1.0f);
    }
}

template <class T, class Number>
void read_as(const PackedArray& array, std::size_t width, bool normalized,
             std::vector<Number>& out) {
    const std::size_t count = out.size() / width;
    Number* to = out.data();
    for (std::size_t i = 0; i < count; ++i) {
        const char* const element = array.bytes.data() + i * array.stride;
        for (std::size_t k = 0; k < width; ++k) {
            T value;
            std::memcpy(&value, element + k * sizeof(T), sizeof value);
            *to++ = number_of<Number>(value, normalized);
        }
    }
}

template <class Number>
void read(const PackedArray& array, std::size_t width, bool normalized, std::vector<Number>& out) {
    switch (array.component) {
        case Component::kInt8:
            return read_as<std::int8_t>(array, width, normalized, out);
        case Component::kUint8:
            return read_as<std::uint8_t>(array, width, normalized, out);
        case Component::kInt16:
            return read_as<std::int16_t>(array, width, normalized, out);
        case Component::kUint16:
            return read_as<std::uint16_t>(array, width, normalized, out);
        case Component::kUint32:
            return read_as<std::uint32_t>(array, width, normalized, out);
        case Component::kFloat:
            return read_as<float>(array, width, normalized, out);
    }
}

bool is_unsigned(Component component, bool allow_32_bits) {
    return component == Component::kUint8 || component == Component::kUint16 ||
           (allow_32_bits && component == Component::kUint32);
}

void require_shape(const Accessor& accessor, std::size_t width, std::size_t vertex_count) {
    if (accessor.width != width) {
        const auto* const type =
            std::ranges::find(kTypes, width, &std::pair<std::string_view, std::size_t>::second);
        accessor.at.at("type").fail("must be {} here", type->first);
    }
    if (vertex_count == 0 || accessor.count == vertex_count) return;
    accessor.at.at("count").fail("is {}, but the positions of its primitive are {}", accessor.count,
                                 vertex_count);
}

/// The elements of the buffer view that `owner` refers to.
PackedArray packed(const GltfFile& file, const JsonAt& owner, Component component,
                   std::size_t width, std::size_t count, bool may_have_stride) {
    const View view = file.view(owner.at("bufferView"));
    const std::uint64_t offset = owner.count_or("byteOffset", 0);
    const std::size_t element = width * size_of(component);
    std::uint64_t stride = element;
    if (const std::optional<JsonAt> given = view.at.find("byteStride"); given && may_have_stride) {
        stride = given->count();
        if (stride < element || stride > 252)
            given->fail("is {}; elements have {} bytes", stride, element);
    }
    // count < 2^32 and stride <= 252, so that nothing overflows.
    const std::uint64_t needed = stride * (count - 1) + element;
    if (needed > view.bytes.size() || offset > view.bytes.size() - needed) {
        owner.fail("bytes {} to {} are not in {}, which has {}", offset, offset + needed,
                   view.at.path(), view.bytes.size());
    }
    return {view.bytes.substr(offset, needed), stride, component};
}

void open_sparse(const GltfFile& file, const JsonAt& sparse, Accessor& accessor) {
    const std::uint64_t count = sparse.at("count").count();
    if (count == 0 || count > accessor.count)
        sparse.at("count").fail("is {}; must be from 1 to {}", count, accessor.count);
    accessor.sparse_count = count;
    const JsonAt indices = sparse.at("indices");
    const Component index_component = component_of(indices.at("componentType"));
    if (!is_unsigned(index_component, true))
        indices.at("componentType").fail("must be 5121, 5123 or 5125 here");
    accessor.sparse_indices = packed(file, indices, index_component, 1, count, false);
    accessor.sparse_values =
        packed(file, sparse.at("values"), accessor.base.component, accessor.width, count, false);
}

template <class Number>
std::vector<Number> read_all(const Accessor& accessor) {
    const std::size_t width = accessor.width;
    std::vector<Number> values(accessor.count * width);
    if (!accessor.base.bytes.empty()) read(accessor.base, width, accessor.normalized, values);
    if (accessor.sparse_count == 0) return values;
    std::vector<std::uint32_t> indices(accessor.sparse_count);
    read(accessor.sparse_indices, 1, false, indices);
    std::vector<Number> sparse(accessor.sparse_count * width);
    read(accessor.sparse_values, width, accessor.normalized, sparse);
    for (std::size_t i = 0; i < indices.size(); ++i) {
        if (indices[i] >= accessor.count || (i > 0 && indices[i] <= indices[i - 1])) {
            accessor.at.at("sparse").at("indices").fail(
                "index {} is {}; they must increase and stay below {}", i, indices[i],
                accessor.count);
        }
        std::copy_n(&sparse[i * width], width, &values[indices[i] * width]);
    }
    return values;
}

/// An accessor of elements of `width` numbers, of `vertex_count` elements unless that is 0.
Accessor open_accessor(const GltfFile& file, const JsonAt& reference, std::size_t width,
                       std::size_t vertex_count) {
    const std::size_t index = reference.index_below(file.count("accessors"), "accessors");
    Accessor accessor{.at = file.element("accessors", index)};
    const JsonAt& at = accessor.at;
    const std::uint64_t count = at.at("count").count();
    if (count == 0 || count > kMaxElements)
        at.at("count").fail("is {}; must be from 1 to {}", count, kMaxElements);
    accessor.count = count;
    accessor.width = width_of(at.at("type"));
    const Component component = component_of(at.at("componentType"));
    accessor.base.component = component;
    if (const auto normalized = at.find("normalized")) accessor.normalized = normalized->boolean();
    if (at.find("bufferView")) {
        accessor.base = packed(file, at, component, accessor.width, accessor.count, true);
    } else if (count > file.buffer_bytes()) {
        at.at("count").fail(
            "is {}, but the accessor has no bufferView, and all buffers have {} bytes", count,
            file.buffer_bytes());
    }
    if (const auto sparse = at.find("sparse")) open_sparse(file, *sparse, accessor);
    require_shape(accessor, width, vertex_count);
    return accessor;
}

Accessor open_wanted(const GltfFile& file, const JsonAt& reference, const Wanted& wanted) {
    Accessor accessor = open_accessor(file, reference, wanted.width, wanted.vertex_count);
    const Component component = accessor.base.component;
    const bool is_allowed =
        component == Component::kFloat ||
        (component != Component::kUint32 &&
         (wanted.integers == Wanted::Integers::kAny ||
          (wanted.integers == Wanted::Integers::kNormalized && accessor.normalized)));
    if (!is_allowed) {
        accessor.at.at("componentType")
            .fail("must be 5126 (float){} here",
                  wanted.integers == Wanted::Integers::kNone
                      ? ""
                      : " or an integer of 8 or 16 bits that is normalized");
    }
    return accessor;
}

}  // namespace

std::vector<float> floats(const GltfFile& file, const JsonAt& reference, const Wanted& wanted) {
    return read_all<float>(open_wanted(file, reference, wanted));
}

std::vector<std::uint32_t> integers(const GltfFile& file, const JsonAt& reference,
                                    std::size_t width, std::size_t vertex_count) {
    const Accessor accessor = open_accessor(file, reference, width, vertex_count);
    const bool allow_32_bits = width == 1;
    if (!is_unsigned(accessor.base.component, allow_32_bits) || accessor.normalized) {
        accessor.at.at("componentType")
            .fail("must be 5121 or 5123{} here, and not normalized",
                  allow_32_bits ? " or 5125" : "");
    }
    return read_all<std::uint32_t>(accessor);
}

}  // namespace mray::gltf
