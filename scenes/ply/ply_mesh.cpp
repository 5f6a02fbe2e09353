#include "scenes/ply/ply_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <unordered_map>

#include "common/base/errors.h"
#include "common/base/hash.h"

namespace mray {
namespace {

/// Whether channels have types whose meaning is known.
bool are_channels(const PlyElement& vertices) {
    return std::all_of(vertices.properties.begin(), vertices.properties.end(),
                       [](const PlyProperty& property) {
                           return property.role != PlyRole::kColour ||
                                  property.type == PlyScalar::kUint8 || !is_integer(property.type);
                       });
}

void drop(PlyElement& element, PlyRole role) {
    for (PlyProperty& property : element.properties)
        if (property.role == role) property.role = PlyRole::kNone;
}

/// A position and the bits of a normal.
struct SmoothCorner {
    std::array<std::uint32_t, 6> bits;
    bool operator==(const SmoothCorner&) const = default;
};
struct SmoothCornerHash {
    std::size_t operator()(const SmoothCorner& corner) const {
        return static_cast<std::size_t>(hash_of(corner));
    }
};

}  // namespace

PlyMesh::PlyMesh(PlyHeader& header, const std::string& name, const MeshFileOptions& options)
    : options_(options), rules_(options.lenient) {
    for (PlyElement& element : header.elements) {
        if (element.name != "vertex") continue;
        bool has_colours = options.materials && element.has_all(PlyRole::kColour);
        if (has_colours && !are_channels(element)) {
            has_colours = false;
            options.warn({fmt::format("{}:{}", name, element.line),
                          "colours of this type are not read, only uchar, float and double; "
                          "taken as grey"});
        }
        const bool has_normals = options.normals && element.has_all(PlyRole::kNormal);
        if (!has_colours) drop(element, PlyRole::kColour);
        if (!has_normals) drop(element, PlyRole::kNormal);
        const auto count = static_cast<std::size_t>(element.count);
        mesh_.positions.resize(count);
        if (has_colours) mesh_.vertex_colours.resize(count);
        if (has_normals) normals_.resize(count);
    }
}

std::vector<vec3>& PlyMesh::components(PlyRole role) {
    if (role == PlyRole::kColour) return mesh_.vertex_colours;
    return role == PlyRole::kNormal ? normals_ : mesh_.positions;
}

void PlyMesh::check_vertex(std::size_t vertex, const Place& place) {
    for (int axis = 0; axis < 3; ++axis) {
        const float value = mesh_.positions[vertex][axis];
        if (!MeshRules::is_good(value))
            rules_.take_bad_coordinate(value, fmt::format("{}", value), place);
        if (mesh_.vertex_colours.empty()) continue;
        float& channel = mesh_.vertex_colours[vertex][axis];
        if (std::isfinite(channel)) continue;
        constexpr const char* kWhat = "colour of a vertex is not finite";
        if (!options_.lenient) {
            throw Error(ErrorKind::kBadInput, fmt::format("{}: {}; repair it", place(), kWhat),
                        Hint::kLenient);
        }
        odd_channels_.add([&] { return Warning{place(), fmt::format("{}; taken as 0", kWhat)}; });
        channel = 0;
    }
}

void PlyMesh::add_face(std::span<const std::int64_t> corners, const Place& place) {
    if (!rules_.keeps_face(corners.size(), false, place)) return;
    for (const std::int64_t corner : corners) {
        if (corner >= 0 && static_cast<std::size_t>(corner) < vertex_count()) continue;
        rules_.leave_out(fmt::format("vertex {} of {}; indices start at 0 and end below the "
                                     "number of vertices",
                                     corner, vertex_count()),
                         place);
        return;
    }
    rules_.count_face(corners.size(), place);
    for (const std::int64_t corner : corners)
        mesh_.faces.corners.push_back(static_cast<std::uint32_t>(corner));
    mesh_.faces.corner_counts.push_back(static_cast<std::uint32_t>(corners.size()));
}

void PlyMesh::reserve_triangles(std::size_t count) {
    mesh_.faces.corners.reserve(3 * count);
    mesh_.faces.corner_counts.reserve(count);
}

void PlyMesh::count_triangles(std::size_t count, const Place& place) {
    rules_.count_triangles(count, place);
    mesh_.faces.corner_counts.insert(mesh_.faces.corner_counts.end(), count, 3);
}

void PlyMesh::add_strips(std::span<const std::int64_t> corners, const Place& place) {
    std::size_t begin = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        if (corners[i] == -1) begin = i + 1;
        if (i < begin + 2) continue;
        std::array triangle = {corners[i - 2], corners[i - 1], corners[i]};
        if ((i - begin) % 2 == 1) std::swap(triangle[0], triangle[1]);
        add_face(triangle, place);
    }
}

void PlyMesh::number_corners() {
    const std::vector<std::uint32_t>& corners = mesh_.faces.corners;
    // The first corner of a vertex, and of each position and normal.
    constexpr std::uint32_t kNone = 0xFFFFFFFFu;
    std::vector<std::uint32_t> numbers(vertex_count(), kNone);
    std::unordered_map<SmoothCorner, std::uint32_t, SmoothCornerHash> firsts;
    mesh_.smooth.reserve(corners.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
        std::uint32_t& number = numbers[corners[i]];
        if (number == kNone) {
            const vec3& p = mesh_.positions[corners[i]];
            const vec3& n = normals_[corners[i]];
            SmoothCorner corner = {};
            for (int axis = 0; axis < 3; ++axis) {
                // -0 is 0.
                corner.bits[static_cast<std::size_t>(axis)] =
                    std::bit_cast<std::uint32_t>(p[axis] + 0.0f);
                corner.bits[static_cast<std::size_t>(axis) + 3] =
                    std::bit_cast<std::uint32_t>(n[axis] + 0.0f);
            }
            number = firsts.try_emplace(corner, static_cast<std::uint32_t>(i)).first->second;
        }
        mesh_.smooth.push_back(number);
    }
}

FileMesh PlyMesh::finish() {
    rules_.tell(options_.warn);
    odd_channels_.tell(options_.warn);
    if (!normals_.empty()) number_corners();
    return std::move(mesh_);
}

}  // namespace mray
