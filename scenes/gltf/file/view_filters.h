// Filters of compressed buffer views.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace mray::gltf {

/// The filters of EXT_meshopt_compression: unit vectors, quaternions and floats.
enum class ViewFilter { kNone, kOctahedral, kQuaternion, kExponential };

/// Whether elements of `stride` bytes, a multiple of 4, may have the filter.
bool fits_filter(ViewFilter filter, std::uint64_t stride);

/// Decodes elements of `stride` bytes in place. Any bytes give some result, with the same bits on
/// every machine: the filters of meshoptimizer estimate roots as the processor does.
void apply_filter(ViewFilter filter, std::size_t stride, std::string& bytes);

}  // namespace mray::gltf
