#include "scenes/mesh/mesh_file.h"

#include <fmt/format.h>

#include "common/text/text.h"

namespace mray {
namespace {

[[noreturn]] void fail(const std::string& place, const std::string& what, Hint hint = Hint::kNone) {
    throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", place, what), hint);
}

}  // namespace

void set_positions(FileMesh& mesh, std::span<const glm::dvec3> file,
                   const MeshFileOptions& options) {
    mesh.origin = options.origin ? *options.origin : origin_of(file);
    mesh.positions = mesh.origin.to_world(file);
    mesh.is_coarse = options.origin && mesh.origin.rounds_coarsely(file);
}

void require_faces(const FileMesh& mesh, const std::string& name, std::string_view kind) {
    if (!mesh.faces.corner_counts.empty()) return;
    const char* const missing = mesh.positions.empty() ? "no vertices" : "no faces";
    throw Error(ErrorKind::kBadInput, "{}: {}; is it {}?", name, missing, kind);
}

bool MeshRules::are_good(std::span<const vec3> positions) {
    // Without a branch, so that the compiler makes vectors of it.
    std::uint32_t bad = 0;
    for (const vec3& p : positions)
        bad |= std::uint32_t{!is_good(p.x)} | std::uint32_t{!is_good(p.y)} |
               std::uint32_t{!is_good(p.z)};
    return bad == 0;
}

std::optional<Warning> MeshRules::check_frame(const std::string& file, double frame,
                                              std::span<const vec3> positions, bool lenient) {
    const auto bad = std::ranges::find_if_not(positions, [](const vec3& p) { return is_good(p); });
    if (bad == positions.end()) return std::nullopt;
    const std::string what =
        fmt::format("frame {}: vertex {} has a coordinate that is not finite or beyond 1e30", frame,
                    bad - positions.begin());
    if (!lenient) fail(file, what + "; repair it", Hint::kLenient);
    return Warning{file, what + "; kept as it is"};
}

void MeshRules::take_bad_coordinate(double value, std::string_view text) {
    const char* const what = std::isfinite(value) ? "is beyond 1e30" : "is not finite";
    if (!lenient_) {
        fail(place_(), fmt::format("coordinate {} {}; repair it", quote(text), what),
             Hint::kLenient);
    }
    bad_coordinates_.add(place_, "coordinate {} {}; kept as it is", quote(text), what);
}

bool MeshRules::keeps_face(std::uint64_t corners, bool is_cut) {
    if (corners >= 3) return true;
    const std::string what = fmt::format("face of {} corner{}", corners, corners == 1 ? "" : "s");
    if (!lenient_ && is_cut) fail(place_(), what + " at the end; the file was cut, write it again");
    if (!lenient_ && corners < 2) fail(place_(), what + "; a face needs 3, is the file complete?");
    left_out_.add(place_, "{}; left out", what);
    return false;
}

void MeshRules::count_triangles(std::uint64_t count) {
    triangle_count_ += count;
    if (triangle_count_ <= kMaxTriangles) return;
    throw Error(ErrorKind::kLimit, "{}: more than {} triangles; split or simplify the scene",
                place_(), kMaxTriangles);
}

void MeshRules::leave_out(const std::string& problem) {
    if (!lenient_) fail(place_(), problem);
    left_out_.add(place_, "{}; face left out", problem);
}

void MeshRules::tell(const WarnFunction& warn) const {
    left_out_.tell(warn);
    bad_coordinates_.tell(warn);
    clamped_.tell(warn);
}

double channel_of(double value, double full, WarningCount& clamped, const PlaceText& place) {
    // NaN becomes 0.
    const double channel = std::min(std::max(0.0, value), full);
    if (channel != value) clamped.add(place, "colour {} is not from 0 to {}; clamped", value, full);
    return channel / full;
}

std::string not_a_number(std::string_view text) {
    const bool has_comma = text.find(',') != std::string_view::npos;
    return fmt::format(
        "{} is not a number; {}", quote(text),
        has_comma ? "write decimals with a point, not a comma" : "is the file complete?");
}

}  // namespace mray
