#include "common/scene/vertex_normals.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "common/interop/surface.h"

namespace mray {
namespace {

constexpr std::size_t kGrain = 4096;

template <class Visit>
void for_each_corner(const uvec3& ids, Visit visit) {
    for (int k = 0; k < 3; ++k)
        if (ids[k] != kFlatCorner) visit(ids[k], static_cast<std::uint32_t>(k));
}

/// The angle between a and b, whose cross product has this length, which is not 0: within 2^-24.
/// The functions of a libm differ between processors.
double angle_between(const glm::dvec3& a, const glm::dvec3& b, double across) {
    const double along = glm::dot(a, b);
    const double length = std::sqrt(across * across + along * along);
    const double half = along > 0 ? across / (length + along) : (length - along) / across;
    const double quarter = half / (1 + std::sqrt(1 + half * half));
    // The tangent of an eighth, at most 0.42: the first omitted term is below 2^-26.
    const double x = quarter / (1 + std::sqrt(1 + quarter * quarter));
    const double x2 = x * x;
    double sum = 0;
    for (int k = 17; k >= 1; k -= 2) sum = 1.0 / k - x2 * sum;
    return 8 * x * sum;
}

}  // namespace

VertexNormals::VertexNormals(std::span<const uvec3> triangles, std::span<const uvec3> ids)
    : triangles_(triangles.begin(), triangles.end()),
      ids_(ids.begin(), ids.end()),
      weighted_(3 * triangles.size()) {
    assert(triangles.size() == ids.size());
    std::uint32_t count = 0;
    for (const uvec3& t : ids)
        for_each_corner(t, [&](std::uint32_t id, auto) { count = std::max(count, id + 1); });
    begins_.resize(std::size_t{count} + 1);
    for (const uvec3& t : ids)
        for_each_corner(t, [&](std::uint32_t id, auto) { ++begins_[id + 1]; });
    for (std::size_t i = 0; i < count; ++i) begins_[i + 1] += begins_[i];
    users_.resize(begins_.back());
    std::vector<std::uint32_t> next(begins_.begin(), begins_.end() - 1);
    for (std::size_t prim = 0; prim < ids.size(); ++prim) {
        for_each_corner(ids[prim], [&](std::uint32_t id, std::uint32_t k) {
            users_[next[id]++] = static_cast<std::uint32_t>(3 * prim) + k;
        });
    }
    // One at least, so that the shader has an address to read from.
    normals_.resize(std::max<std::size_t>(count, 1));
}

void VertexNormals::update(std::span<const vec3> positions) {
    using Range = tbb::blocked_range<std::size_t>;
    tbb::parallel_for(Range(0, triangles_.size(), kGrain), [&](const Range& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            const glm::dvec3 p[] = {positions[triangles_[i].x], positions[triangles_[i].y],
                                    positions[triangles_[i].z]};
            const bool is_finite = p[0].x != kInvalidCoordinate && p[1].x != kInvalidCoordinate &&
                                   p[2].x != kInvalidCoordinate;
            const glm::dvec3 normal = glm::cross(p[1] - p[0], p[2] - p[0]);
            const double across = std::sqrt(glm::dot(normal, normal));
            for (std::size_t k = 0; k < 3; ++k) {
                vec3& weighted = weighted_[3 * i + k];
                weighted = vec3(0.0f);
                if (!is_finite || across == 0) continue;
                const double angle =
                    angle_between(p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k], across);
                weighted = vec3(normal * (angle / across));
            }
        }
    });
    tbb::parallel_for(Range(0, begins_.size() - 1, kGrain), [&](const Range& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            vec3 sum(0.0f);
            for (std::uint32_t k = begins_[i]; k < begins_[i + 1]; ++k)
                sum = sum + weighted_[users_[k]];
            normals_[i] = unit(sum);
        }
    });
}

}  // namespace mray
