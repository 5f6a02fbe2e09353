// The header of a PLY file.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mray {

enum class PlyEncoding { kText, kLittleEndian, kBigEndian };

/// A type of numbers, all of which are exact in a double.
struct PlyType {
    /// The format's author gives the first name, and many programs write the second one.
    std::array<std::string_view, 2> names;
    std::size_t size;
    bool is_integer;
    /// Reads a number in the byte order of this machine.
    double (*value)(const char* bytes);
};

struct PlyProperty {
    std::string name;
    const PlyType* type;
    /// A list has a type for the number of its entries; a scalar has null.
    const PlyType* count_type = nullptr;
    /// True for a list of the corners of a face, or of strips.
    bool has_corners = false;

    const PlyType& first_type() const { return count_type != nullptr ? *count_type : *type; }
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
                return property.name == axis && property.count_type == nullptr;
            });
        });
    }
    bool may_have_faces() const { return name == "face" || name == "tristrips"; }
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
