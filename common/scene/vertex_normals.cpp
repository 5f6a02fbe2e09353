#include "common/scene/vertex_normals.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "common/interop/surface.h"

namespace mray {
namespace {

constexpr std::size_t kGrain = 4096;

template <class Visit>
void for_each_corner(const uvec3& ids, Visit visit) {
    for (int k = 0; k < 3; ++k)
        if (ids[k] != kFlatCorner) visit(ids[k], static_cast<std::uint32_t>(k));
}

/// The angle between a and b, whose cross product has the length `across`, not 0: within 2^-28. The
/// functions of a libm differ between processors.
double angle_between(const glm::dvec3& a, const glm::dvec3& b, double across) {
    constexpr double kTangentOfEighth = 0.41421356237309503;
    const double along = glm::dot(a, b);
    const double least = std::min(across, std::abs(along));
    const double most = std::max(across, std::abs(along));
    // The arc tangent of least / most, from that of a number of at most kTangentOfEighth.
    const bool is_moved = least > kTangentOfEighth * most;
    const double x = is_moved ? (least - most) / (least + most) : least / most;
    const double x2 = x * x;
    double sum = 0;
    for (int k = 17; k >= 1; k -= 2) sum = 1.0 / k - x2 * sum;
    double angle = x * sum + (is_moved ? 0.25 : 0) * std::numbers::pi;
    if (across > std::abs(along)) angle = 0.5 * std::numbers::pi - angle;
    return along < 0 ? std::numbers::pi - angle : angle;
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
    static std::atomic<std::uint64_t> last_version = 0;
    version_ = ++last_version;
    using Range = tbb::blocked_range<std::size_t>;
    tbb::parallel_for(Range(0, triangles_.size(), kGrain), [&](const Range& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            const glm::dvec3 p[] = {positions[triangles_[i].x], positions[triangles_[i].y],
                                    positions[triangles_[i].z]};
            const bool is_finite = p[0].x != kInvalidCoordinate && p[1].x != kInvalidCoordinate &&
                                   p[2].x != kInvalidCoordinate;
            const glm::dvec3 normal = glm::cross(p[1] - p[0], p[2] - p[0]);
            const double across = std::sqrt(glm::dot(normal, normal));
            vec3* const weighted = &weighted_[3 * i];
            std::fill_n(weighted, 3, vec3(0.0f));
            if (!is_finite || across == 0) continue;
            double angle[3];
            for (int k = 0; k < 2; ++k)
                angle[k] = angle_between(p[k + 1] - p[k], p[(k + 2) % 3] - p[k], across);
            angle[2] = std::numbers::pi - (angle[0] + angle[1]);
            for (int k = 0; k < 3; ++k) weighted[k] = vec3(normal * (angle[k] / across));
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
