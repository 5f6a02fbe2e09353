#include "scenes/polygons/triangulate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "common/base/errors.h"
#include "scenes/polygons/ear_clipper.h"

namespace mray {
namespace {

using Corners = std::span<const std::uint32_t>;

// Newell's normal (M. E. Newell et al. 1972), relative to the first corner so that a face far from
// the origin keeps its digits.
std::array<double, 3> face_normal(Corners corners, std::span<const vec3> positions) {
    const glm::dvec3 origin(positions[corners[0]]);
    glm::dvec3 sum(0.0);
    glm::dvec3 last(0.0);
    for (const std::uint32_t corner : corners) {
        const glm::dvec3 p = glm::dvec3(positions[corner]) - origin;
        sum += glm::dvec3(last.y * p.z - last.z * p.y, last.z * p.x - last.x * p.z,
                          last.x * p.y - last.y * p.x);
        last = p;
    }
    return {sum.x, sum.y, sum.z};
}

// Projects the corners along the axis along which the face is largest, which keeps coordinates
// exact. Orders the axes so that the face is counter-clockwise. Returns false for a face that has
// no area or is not finite.
bool project(Corners corners, std::span<const vec3> positions, std::vector<PlanePoint>& points) {
    const std::array<double, 3> normal = face_normal(corners, positions);
    int dropped = 0;
    for (int axis = 1; axis < 3; ++axis) {
        if (std::abs(normal[axis]) > std::abs(normal[dropped])) dropped = axis;
    }
    if (normal[dropped] == 0) return false;
    int x = (dropped + 1) % 3;
    int y = (dropped + 2) % 3;
    if (normal[dropped] < 0) std::swap(x, y);
    points.clear();
    for (const std::uint32_t corner : corners) {
        const vec3 p = positions[corner];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return false;
        points.push_back({p[x], p[y]});
    }
    return true;
}

bool fan_covers(std::span<const PlanePoint> points) {
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {
        if (!(doubled_area(points[0], points[i], points[i + 1]) > 0)) return false;
    }
    return true;
}

void append_fan(Corners corners, std::vector<uvec3>& triangles) {
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
        triangles.emplace_back(corners[0], corners[i], corners[i + 1]);
    }
}

}  // namespace

std::vector<uvec3> triangulate(const Polygons& faces, std::span<const vec3> positions,
                               const std::string& name, bool lenient, const WarnFunction& warn) {
    std::vector<uvec3> triangles;
    triangles.reserve(faces.corners.size() - 2 * faces.corner_counts.size());
    EarClipper clipper;
    std::vector<PlanePoint> points;
    std::vector<std::array<std::uint32_t, 3>> ears;
    WarningCount intricate;
    std::size_t first = 0;
    for (std::size_t face = 0; face < faces.corner_counts.size(); ++face) {
        const Corners corners(faces.corners.data() + first, faces.corner_counts[face]);
        first += corners.size();
        if (corners.size() == 3 || !project(corners, positions, points) || fan_covers(points)) {
            append_fan(corners, triangles);
            continue;
        }
        ears.clear();
        if (!clipper.clip(points, kTriangulationStepsPerCorner * corners.size(), ears)) {
            const auto what = [&] {
                return fmt::format("face {} of {} corners is too intricate to triangulate",
                                   face + 1, corners.size());
            };
            if (!lenient) {
                throw Error(ErrorKind::kBadInput,
                            fmt::format("{}: {}; write triangles instead", name, what()));
            }
            intricate.add([&] { return Warning{name, what()}; });
            append_fan(corners, triangles);
        }
        for (const auto& [a, b, c] : ears) {
            triangles.emplace_back(corners[a], corners[b], corners[c]);
        }
    }
    intricate.tell(warn);
    return triangles;
}

std::vector<uvec3> corners_of_triangles(const Polygons& faces, std::span<const uvec3> triangles) {
    std::vector<uvec3> indices(triangles.size());
    std::size_t first = 0;
    std::size_t prim = 0;
    for (const std::uint32_t count : faces.corner_counts) {
        const Corners corners = std::span(faces.corners).subspan(first, count);
        for (const std::size_t end = prim + count - 2; prim < end; ++prim) {
            for (int k = 0; k < 3; ++k) {
                const auto corner = std::find(corners.begin(), corners.end(), triangles[prim][k]);
                assert(corner != corners.end());
                indices[prim][k] = static_cast<std::uint32_t>(
                    first + static_cast<std::size_t>(corner - corners.begin()));
            }
        }
        first += count;
    }
    return indices;
}

}  // namespace mray
