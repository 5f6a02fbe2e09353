#include "clips/ply/ply_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <unordered_map>

#include "common/base/errors.h"
#include "common/base/hash.h"

namespace mray {
namespace {

constexpr std::array kColours = {PlyRole::kRed, PlyRole::kGreen, PlyRole::kBlue};
constexpr std::array kNormals = {PlyRole::kNormalX, PlyRole::kNormalY, PlyRole::kNormalZ};

const PlyProperty* property_of(const PlyElement& element, PlyRole role) {
    const auto found =
        std::find_if(element.properties.begin(), element.properties.end(),
                     [&](const PlyProperty& property) { return property.role == role; });
    return found == element.properties.end() ? nullptr : &*found;
}

bool has_all(const PlyElement& element, std::span<const PlyRole> roles) {
    return std::all_of(roles.begin(), roles.end(),
                       [&](PlyRole role) { return property_of(element, role) != nullptr; });
}

void drop(PlyElement& element, std::span<const PlyRole> roles) {
    for (PlyProperty& property : element.properties) {
        if (std::find(roles.begin(), roles.end(), property.role) != roles.end())
            property.role = PlyRole::kNone;
    }
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
    : name_(name), options_(options), rules_(options.lenient) {
    for (PlyElement& element : header.elements) {
        if (element.name != "vertex") continue;
        vertex_count_ = static_cast<std::size_t>(element.count);
        drop_colours(element);
        drop_normals(element);
    }
}

void PlyMesh::drop_colours(PlyElement& vertices) {
    has_colours_ = options_.materials && has_all(vertices, kColours);
    if (has_colours_) {
        for (const PlyRole role : kColours) {
            const PlyProperty& property = *property_of(vertices, role);
            if (property.type == PlyScalar::kUint8 || !is_integer(property.type)) continue;
            has_colours_ = false;
            options_.warn({fmt::format("{}:{}", name_, property.line),
                           "colours of this type are not read, only uchar, float and double; "
                           "taken as grey"});
            break;
        }
    }
    if (!has_colours_) drop(vertices, kColours);
}

void PlyMesh::drop_normals(PlyElement& vertices) {
    has_normals_ = options_.normals && has_all(vertices, kNormals);
    if (!has_normals_) drop(vertices, kNormals);
}

void PlyMesh::make_vertices() {
    mesh_.positions.resize(vertex_count_);
    if (has_colours_) mesh_.vertex_colours.resize(vertex_count_);
    if (has_normals_) normals_.resize(vertex_count_);
}

std::vector<vec3>& PlyMesh::components(PlyRole role) {
    if (role >= PlyRole::kRed) return mesh_.vertex_colours;
    return role >= PlyRole::kNormalX ? normals_ : mesh_.positions;
}

int PlyMesh::axis_of(PlyRole role) {
    assert(role >= PlyRole::kX && role <= PlyRole::kBlue);
    return (static_cast<int>(role) - static_cast<int>(PlyRole::kX)) % 3;
}

void PlyMesh::check_vertices(std::size_t begin, std::size_t end,
                             const std::function<std::string(std::size_t)>& place_of) {
    const bool is_good =
        MeshRules::are_good(std::span(mesh_.positions).subspan(begin, end - begin));
    for (std::size_t i = begin; i < end && !is_good; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            const float value = mesh_.positions[i][axis];
            if (!MeshRules::is_good(value))
                rules_.take_bad_coordinate(value, fmt::format("{}", value),
                                           [&] { return place_of(i); });
        }
    }
    for (std::size_t i = begin; i < end && has_colours_; ++i) {
        for (int axis = 0; axis < 3; ++axis)
            check_channel(mesh_.vertex_colours[i][axis], [&] { return place_of(i); });
    }
}

void PlyMesh::check_channel(float& value, const Place& place) {
    if (std::isfinite(value)) return;
    constexpr const char* kWhat = "colour of a vertex is not finite";
    if (!options_.lenient) {
        throw Error(ErrorKind::kBadInput, fmt::format("{}: {}; repair it", place(), kWhat),
                    Remedy::kLenient);
    }
    odd_channels_.add([&] { return Warning{place(), fmt::format("{}; taken as 0", kWhat)}; });
    value = 0;
}

void PlyMesh::add_face(std::span<const std::int64_t> corners, const Place& place) {
    if (!rules_.keeps_face(corners.size(), false, place)) return;
    for (const std::int64_t corner : corners) {
        if (corner >= 0 && static_cast<std::size_t>(corner) < vertex_count_) continue;
        rules_.leave_out(fmt::format("vertex {} of {}; indices start at 0 and end below the "
                                     "number of vertices",
                                     corner, vertex_count_),
                         place);
        return;
    }
    rules_.count_face(corners.size(), place);
    for (const std::int64_t corner : corners)
        mesh_.faces.corners.push_back(static_cast<std::uint32_t>(corner));
    mesh_.faces.corner_counts.push_back(static_cast<std::uint32_t>(corners.size()));
}

void PlyMesh::add_triangles(std::span<const std::uint32_t> corners, const Place& place) {
    rules_.count_triangles(corners.size() / 3, place);
    mesh_.faces.corners.insert(mesh_.faces.corners.end(), corners.begin(), corners.end());
    mesh_.faces.corner_counts.insert(mesh_.faces.corner_counts.end(), corners.size() / 3, 3);
}

void PlyMesh::reserve_triangles(std::uint64_t count) {
    mesh_.faces.corners.reserve(static_cast<std::size_t>(3 * count));
    mesh_.faces.corner_counts.reserve(static_cast<std::size_t>(count));
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
    std::vector<std::uint32_t> numbers(vertex_count_, kNone);
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
    if (has_normals_) number_corners();
    return std::move(mesh_);
}

}  // namespace mray
