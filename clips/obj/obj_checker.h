// Checks the text of an OBJ file token by token.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "clips/mesh/mesh_rules.h"
#include "clips/warning_count.h"
#include "common/interop/platform.h"
#include "common/scene/textures.h"

namespace mray {

/// A longer line is not OBJ text. Faces are exempt: a polygon of 200,000 corners is one
/// line of 1.3 MB.
inline constexpr std::size_t kMaxLineBytes = std::size_t{1} << 20;

struct ObjCheckOptions {
    /// Accept coordinates that are not finite or too large, and leave out, with a warning, faces
    /// that cannot be read.
    bool lenient = false;
    /// A file with more is refused (kLimit).
    std::uint64_t max_triangles = kMaxTriangles;
    /// Keep which normals and texture coordinates corners have.
    bool normals = false;
    bool texcoords = false;
    WarnFunction warn;
};

/// Stands for the index of a normal or of texture coordinates.
inline constexpr std::uint32_t kNoAttribute = 0xFFFFFFFFu;

/// Results of the check.
struct CheckedObj {
    /// Each `v`, correctly rounded. (tinyobjloader's own decimal conversion reads nan as 0 and is
    /// not correctly rounded.)
    std::vector<vec3> positions;
    /// Faces of three corners or more, and the number of their corners. A lenient check also counts
    /// faces that name vertices past the last one.
    std::uint64_t face_count = 0;
    std::uint64_t corner_count = 0;
    /// With ObjCheckOptions::normals, each `vn`; a component that is missing or not a number is 0.
    /// For each corner of those faces the index of its normal, or kNoAttribute if it has no normal
    /// or names one that no line before it has defined.
    std::vector<std::array<float, 3>> normals;
    std::vector<std::uint32_t> corner_normals;
    /// With ObjCheckOptions::texcoords, the same of each `vt`. A component that is missing or not a
    /// finite number is 0; `odd_texcoords` counts the latter.
    std::vector<Texcoord> texcoords;
    std::vector<std::uint32_t> corner_texcoords;
    WarningCount odd_texcoords;
};

/// Checks `text` and edits it in place, byte for byte, so that tinyobjloader reads it correctly: a
/// byte order mark, continued lines and trailing comments become blanks, faces keep their position
/// indices only, and unused statements become comments. The remaining statements are `v` of
/// numbers, `f` of indices that are not 0 and fit an int, relative ones within the vertices so far,
/// `usemtl` and `mtllib`. Unless lenient, no index is past the last vertex.
///
/// `name` is the file in messages. Throws Error: kBadInput with file and line, kLimit above
/// max_triangles.
CheckedObj check_obj(std::string& text, const std::string& name, const ObjCheckOptions& options);

}  // namespace mray
