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
std::size_t size_of(PlyScalar type);
constexpr bool is_integer(PlyScalar type) { return type < PlyScalar::kFloat; }

/// The use of a property's values.
enum class PlyRole : std::uint8_t {
    kNone,
    kX,
    kY,
    kZ,
    kNormalX,
    kNormalY,
    kNormalZ,
    kRed,
    kGreen,
    kBlue,
    /// The corners of a face.
    kFace,
    /// The corners of strips of triangles.
    kStrip,
};

struct PlyProperty {
    std::string name;
    PlyScalar type = PlyScalar::kFloat;
    /// The type of the number of entries; a scalar has none.
    std::optional<PlyScalar> count_type = {};
    /// Line of the header, from 1.
    std::uint64_t line = 0;
    PlyRole role = PlyRole::kNone;
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties = {};
    std::uint64_t line = 0;

    /// For messages: in quotes unless it is an element that is read.
    std::string shown_name() const;
    bool has_lists() const;
    /// The bytes of one item of a binary file; lists as if they were empty.
    std::uint64_t least_bytes() const;
};

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::kText;
    std::vector<PlyElement> elements;
    /// The bytes of the header, with the end of its last line, and its lines.
    std::uint64_t size = 0;
    std::uint64_t line_count = 0;
};

/// A longer header is refused.
inline constexpr std::uint64_t kMaxPlyHeaderBytes = std::uint64_t{1} << 20;

/// Parses the header at the beginning of `text` and gives properties their roles. `text` is the
/// whole file or its first kMaxPlyHeaderBytes; lines end as the first one does. `name` is the file
/// in messages.
///
/// Throws Error(kBadInput) with file and line for anything but the statements ply, format (ascii,
/// binary_little_endian, binary_big_endian, 1.0), comment, obj_info, element, property and
/// end_header in their order; for types that are not known, lists whose numbers of entries are no
/// integers, indices that are no integers, names given twice, and vertices without x, y and z.
PlyHeader parse_ply_header(std::string_view text, const std::string& name);

}  // namespace mray
