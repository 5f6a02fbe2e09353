#include "lab/bench/embree/embree_peer.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace mray::bench {
namespace {

constexpr std::size_t kGrain = 1024;
using Range = tbb::blocked_range<std::size_t>;

struct PointSearch {
    const uvec3* triangles;
    const vec3* vertices;
    vec3 point;
    float d2;
    NearestPoint nearest;
};

bool visit_triangle(RTCPointQueryFunctionArguments* args) {
    PointSearch& search = *static_cast<PointSearch*>(args->userPtr);
    const uvec3 t = search.triangles[args->primID];
    const vec3 closest = ericson_closest_point(search.point, search.vertices[t.x],
                                               search.vertices[t.y], search.vertices[t.z]);
    const vec3 offset = closest - search.point;
    const float d2 = glm::dot(offset, offset);
    if (!(d2 < search.d2)) return false;
    search.d2 = d2;
    search.nearest.point = closest;
    search.nearest.prim_id = args->primID;
    args->query->radius = std::sqrt(d2);
    return true;
}

void count_and_reject(const RTCFilterFunctionNArguments* args) {
    auto* counts = static_cast<std::uint64_t*>(args->geometryUserPtr);
    for (unsigned int i = 0; i < args->N; ++i) {
        if (args->valid[i] == 0) continue;
        ++counts[RTCRayN_id(args->ray, args->N, i)];
        args->valid[i] = 0;
    }
}

}  // namespace

EmbreeQueries::EmbreeQueries(const EmbreeDevice& device, const EmbreeMesh& mesh, bool robust,
                             std::size_t most_rays)
    : name_(fmt::format("{} MEDIUM {}", robust ? "robust" : "fast", device.isa())),
      group_(robust ? "robust" : "fast"),
      mesh_(&mesh),
      scene_(device, mesh, RTC_BUILD_QUALITY_MEDIUM, robust),
      counts_(most_rays) {
    const RTCGeometry geometry = rtcGetGeometry(scene_.handle(), 0);
    rtcSetGeometryUserData(geometry, counts_.data());
    rtcSetGeometryIntersectFilterFunction(geometry, count_and_reject);
    rtcCommitGeometry(geometry);
    rtcCommitScene(scene_.handle());
    device.check("set a filter");
}

void EmbreeQueries::find_closest(std::span<const vec3> points,
                                 std::span<NearestPoint> nearest) const {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    tbb::parallel_for(Range(0, points.size(), kGrain), [&](const Range& range) {
        const embree::FlushedDenormals flushed;
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        PointSearch search{mesh_->topology().triangles.data(), mesh_->vertices(), {}, {}, {}};
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            search.point = points[i];
            search.d2 = kInfinity;
            search.nearest = {{0, 0, 0}, kInfinity, kNoPrim};
            RTCPointQuery query;
            query.x = points[i].x;
            query.y = points[i].y;
            query.z = points[i].z;
            query.time = 0;
            query.radius = kInfinity;
            rtcPointQuery(scene_.handle(), &query, &context, visit_triangle, &search);
            search.nearest.distance = std::sqrt(search.d2);
            nearest[i] = search.nearest;
        }
    });
}

void EmbreeQueries::count(std::span<const Ray> rays, bool coherent) {
    std::fill_n(counts_.begin(), rays.size(), 0);
    tbb::parallel_for(Range(0, rays.size(), kGrain), [&](const Range& range) {
        const embree::FlushedDenormals flushed;
        embree::Query query(coherent ? embree::Coherence::kCoherent
                                     : embree::Coherence::kIncoherent);
        RTCRayHit record;
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            embree::set_ray(record.ray, 0, rays[i]);
            record.ray.id = static_cast<unsigned int>(i);
            embree::clear_hit(record, 0);
            query.trace(scene_.handle(), record, nullptr);
        }
    });
}

}  // namespace mray::bench
