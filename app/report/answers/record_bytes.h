// Numbers as the bytes of a record.
#pragma once

#include <bit>
#include <string>

namespace mray::app {

/// Appends the bytes of each number, little-endian and without gaps.
template <class... Numbers>
void append_bytes(std::string& bytes, const Numbers&... numbers) {
    static_assert(std::endian::native == std::endian::little, "written as memory is");
    (bytes.append(reinterpret_cast<const char*>(&numbers), sizeof(numbers)), ...);
}

}  // namespace mray::app
