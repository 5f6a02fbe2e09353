// The rules for vertices and faces, the same for mesh files of all formats.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "scenes/mesh/mesh_file.h"
#include "scenes/warning_count.h"

namespace mray {

/// Finite coordinates beyond this are refused like infinite ones; simulations that diverge write
/// them.
inline constexpr float kMaxCoordinate = 1e30f;

/// Checks vertices and faces while a file is read, and counts what a lenient reading accepts. A
/// `place` returns the place in the file for messages, such as "mesh.obj:12"; it is called for the
/// first fault of a kind.
class MeshRules {
public:
    using Place = std::function<std::string()>;

    explicit MeshRules(bool lenient, std::uint64_t max_triangles = kMaxTriangles)
        : lenient_(lenient), max_triangles_(max_triangles) {}

    /// False for NaN, too.
    static bool is_good(float coordinate) { return std::abs(coordinate) <= kMaxCoordinate; }
    /// Lets what is rounded to the limit through, too.
    static bool is_good(double coordinate) {
        return std::abs(coordinate) <= double{kMaxCoordinate} * (1 + 0x1p-25);
    }
    static bool is_good(const vec3& p) { return is_good(p.x) && is_good(p.y) && is_good(p.z); }
    static bool are_good(std::span<const vec3> positions);
    /// Throws Error(kBadInput), or counts a warning if lenient. `text` is the number as the file
    /// has it.
    void take_bad_coordinate(double value, std::string_view text, const Place& place);

    /// Whether a face is kept: it needs 3 corners. Faces of two corners in the middle of a file are
    /// edges that some exporters write: they are left out with a warning. Unless lenient, throws
    /// Error(kBadInput) for fewer, and for two if `is_cut`: the file may end within the face.
    bool keeps_face(std::uint64_t corners, bool is_cut, const Place& place);
    /// Throws Error(kLimit) if there are more than max_triangles.
    void count_triangles(std::uint64_t count, const Place& place);
    /// A face that cannot be read: throws Error(kBadInput), or counts a warning if lenient.
    void leave_out(const std::string& problem, const Place& place);

    /// Gives the warnings that have been counted.
    void tell(const WarnFunction& warn) const;

private:
    const bool lenient_;
    const std::uint64_t max_triangles_;
    std::uint64_t triangle_count_ = 0;
    WarningCount left_out_;
    WarningCount bad_coordinates_;
};

/// Sets the origin and the positions of a mesh from the coordinates of its file.
void set_positions(FileMesh& mesh, std::span<const glm::dvec3> file,
                   const MeshFileOptions& options);

/// Returns the message for a text that is no number: what is wrong with it, and what to do.
std::string not_a_number(std::string_view text);

/// Throws Error(kBadInput) for a mesh without faces. `name` is the file and `kind` its format in
/// the message: "an OBJ file".
void require_faces(const FileMesh& mesh, const std::string& name, std::string_view kind);

}  // namespace mray
