// Arrays of numbers in the buffers of a glTF file.
//
// Every function throws Error(kBadInput) with the place of the member that is wrong.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "scenes/gltf/gltf_file.h"

namespace mray::gltf {

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
    /// Numbers an element: 3 of a VEC3, 16 of a MAT4.
    std::size_t width = 1;
    bool normalized = false;
    PackedArray base = {};
    /// Elements that replace those of `base`, and their indices, which increase.
    std::size_t sparse_count = 0;
    PackedArray sparse_indices = {};
    PackedArray sparse_values = {};

    bool is_sparse_alone() const { return base.bytes.empty(); }
};

/// `reference` is the member that has the index of the accessor.
Accessor open_accessor(const GltfFile& file, const JsonAt& reference);

/// The elements that a reader of numbers accepts.
struct Wanted {
    /// The number of components, and its name ("VEC3").
    std::size_t width = 1;
    const char* type = "SCALAR";
    /// Whether integers are accepted: those that are normalised, or any.
    enum class Integers { kNone, kNormalized, kAny } integers = Integers::kNone;
};

/// All numbers. Of integers that are normalised, c / 127, c / 255, ... in float, at least -1.
std::vector<float> floats(const Accessor& accessor, const Wanted& wanted);

/// The elements of a sparse accessor that differ from its base.
template <class Number>
struct Sparse {
    std::vector<std::uint32_t> indices;
    std::vector<Number> values;
};
Sparse<float> sparse_floats(const Accessor& accessor, const Wanted& wanted);

/// Unsigned numbers that are not normalised; 32 bits only if `allow_32_bits`.
std::vector<std::uint32_t> integers(const Accessor& accessor, std::size_t width,
                                    bool allow_32_bits);

}  // namespace mray::gltf
