// Arrays of numbers in the buffers of a glTF file.
//
// Every function takes the member that has the index of an accessor, and throws Error(kBadInput)
// with the place of the member that is wrong.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "scenes/gltf/gltf_file.h"

namespace mray::gltf {

/// The elements that a reader of numbers accepts.
struct Wanted {
    /// The numbers of an element: 1 of a SCALAR, 3 of a VEC3, 16 of a MAT4.
    std::size_t width = 1;
    /// Whether integers are accepted: those that are normalised, or any.
    enum class Integers { kNone, kNormalized, kAny } integers = Integers::kNone;
    /// The vertices of a primitive, each of which has an element; 0: any number of elements.
    std::size_t vertex_count = 0;
};

/// All numbers. Of integers that are normalised, c / 127, c / 255, ... in float, at least -1.
std::vector<float> floats(const GltfFile& file, const JsonAt& reference, const Wanted& wanted);

struct SparseFloats {
    /// They increase.
    std::vector<std::uint32_t> indices;
    std::vector<float> values;
};
/// The elements that are not 0 of an accessor without a buffer view; nothing for others.
std::optional<SparseFloats> sparse_floats(const GltfFile& file, const JsonAt& reference,
                                          const Wanted& wanted);

/// Unsigned numbers that are not normalised; 32 bits only for a `width` of 1. `vertex_count` is
/// that of Wanted.
std::vector<std::uint32_t> integers(const GltfFile& file, const JsonAt& reference,
                                    std::size_t width, std::size_t vertex_count);

}  // namespace mray::gltf
