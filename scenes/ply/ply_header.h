// The header of a PLY file.
#pragma once

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

/// The use of a property's values.
enum class PlyRole : std::uint8_t {
    kNone,
    kPosition,
    kNormal,
    kColour,
    /// The corners of a face.
    kFace,
};

struct PlyProperty {
    std::string name;
    PlyScalar type = PlyScalar::kFloat;
    /// The type of the number of entries; a scalar has none.
    std::optional<PlyScalar> count_type = {};
    PlyRole role = PlyRole::kNone;
    /// Of x y z, nx ny nz or red green blue.
    int axis = 0;
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties = {};
    /// Line of the header, from 1.
    std::uint64_t line = 0;

    bool is_read() const;
    /// Whether there are all three properties of a role.
    bool has_all(PlyRole role) const;
};

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::kText;
    std::vector<PlyElement> elements;
    /// The bytes of the header, with the end of its last line, and its lines.
    std::uint64_t size = 0;
    std::uint64_t line_count = 1;
};

/// Parses the header at the beginning of a file and gives properties their roles. Lines end as the
/// first one does. `name` is the file in messages. Numbers of items fit into the text. Throws
/// Error(kBadInput) with file and line.
PlyHeader parse_ply_header(std::string_view text, const std::string& name);

}  // namespace mray
