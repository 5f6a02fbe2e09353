#include "common/scene/vertex_normals.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>

#include "common/interop/surface.h"

namespace mray {
namespace {

constexpr std::size_t kGrain = 4096;

template <class Visit>
void for_each_corner(const uvec3& ids, Visit visit) {
    // A normal that two corners of a triangle share has the triangle once.
    if (ids.x != kFlatCorner) visit(ids.x);
    if (ids.y != kFlatCorner && ids.y != ids.x) visit(ids.y);
    if (ids.z != kFlatCorner && ids.z != ids.x && ids.z != ids.y) visit(ids.z);
}

}  // namespace

VertexNormals::VertexNormals(std::span<const uvec3> triangles, std::span<const uvec3> ids)
    : triangles_(triangles.begin(), triangles.end()),
      ids_(ids.begin(), ids.end()),
      areas_(triangles.size()) {
    assert(triangles.size() == ids.size());
    std::uint32_t count = 0;
    for (const uvec3& t : ids)
        for_each_corner(t, [&](std::uint32_t id) { count = std::max(count, id + 1); });
    begins_.resize(std::size_t{count} + 1);
    for (const uvec3& t : ids) for_each_corner(t, [&](std::uint32_t id) { ++begins_[id + 1]; });
    for (std::size_t i = 0; i < count; ++i) begins_[i + 1] += begins_[i];
    users_.resize(begins_.back());
    std::vector<std::uint32_t> next(begins_.begin(), begins_.end() - 1);
    for (std::size_t prim = 0; prim < ids.size(); ++prim) {
        for_each_corner(ids[prim], [&](std::uint32_t id) {
            users_[next[id]++] = static_cast<std::uint32_t>(prim);
        });
    }
    // One at least, so that the shader has an address to read from.
    normals_.resize(std::max<std::size_t>(count, 1));
}

void VertexNormals::update(std::span<const vec3> positions) {
    using Range = tbb::blocked_range<std::size_t>;
    tbb::parallel_for(Range(0, triangles_.size(), kGrain), [&](const Range& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            const vec3 a = positions[triangles_[i].x];
            const vec3 b = positions[triangles_[i].y];
            const vec3 c = positions[triangles_[i].z];
            const bool is_finite =
                a.x != kInvalidCoordinate && b.x != kInvalidCoordinate && c.x != kInvalidCoordinate;
            areas_[i] = is_finite ? cross3(b - a, c - a) : vec3(0.0f);
        }
    });
    tbb::parallel_for(Range(0, begins_.size() - 1, kGrain), [&](const Range& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            vec3 sum(0.0f);
            for (std::uint32_t k = begins_[i]; k < begins_[i + 1]; ++k)
                sum = sum + areas_[users_[k]];
            normals_[i] = unit(sum);
        }
    });
}

}  // namespace mray
