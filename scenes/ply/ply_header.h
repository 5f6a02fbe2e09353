// The header of a PLY file.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mray {

enum class PlyEncoding { kText, kLittleEndian, kBigEndian };

enum class PlyScalar : std::uint8_t {
    kInt8,
    kUint8,
    kInt16,
    kUint16,
    kInt32,
    kUint32,
    kFloat,
    kDouble,
};
constexpr bool is_integer(PlyScalar type) { return type < PlyScalar::kFloat; }
constexpr std::size_t size_of(PlyScalar type) {
    if (type == PlyScalar::kDouble) return 8;
    return type >= PlyScalar::kInt32 ? 4 : type >= PlyScalar::kInt16 ? 2 : 1;
}

struct PlyProperty {
    std::string name;
    PlyScalar type = PlyScalar::kFloat;
    /// The type of the number of entries; a scalar has none.
    std::optional<PlyScalar> count_type = {};

    /// Whether it is a list of the corners of a face.
    bool has_corners = false;
};

/// The names of three scalars that make a vector.
using PlyAxes = std::array<std::string_view, 3>;
inline constexpr PlyAxes kPlyPosition = {"x", "y", "z"};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties = {};
    /// Line of the header, from 1.
    std::uint64_t line = 0;

    bool has(const PlyAxes& axes) const {
        return std::ranges::all_of(axes, [&](std::string_view axis) {
            return std::ranges::any_of(properties, [&](const PlyProperty& property) {
                return property.name == axis && !property.count_type;
            });
        });
    }
    bool has_faces() const { return std::ranges::any_of(properties, &PlyProperty::has_corners); }
};

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::kText;
    std::vector<PlyElement> elements;
    /// The bytes of the header, with the end of its last line, and its lines.
    std::uint64_t size = 0;
    std::uint64_t line_count = 1;
};

/// Lines end as the first one does. Vertices have positions, faces have corners, and the numbers of
/// items fit into the text. Throws Error(kBadInput) with file and line.
PlyHeader parse_ply_header(std::string_view text, const std::string& name);

}  // namespace mray
