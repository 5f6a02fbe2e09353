// Compiled for the machine that builds it: the header needs AVX2 and FMA.
#include "lab/bench/tinybvh/tinybvh_peer.h"

#define TINYBVH_IMPLEMENTATION
#include <fmt/format.h>
#include <tiny_bvh.h>

#include <algorithm>
#include <memory>

#include "common/bvh/box.h"

namespace mray::bench {
namespace {

/// A triangle with an infinite or NaN vertex becomes a point that no ray meets.
std::vector<tinybvh::bvhvec4> corners_of(const BenchScene& scene) {
    std::vector<tinybvh::bvhvec4> corners;
    corners.reserve(3 * scene.topology().triangles.size());
    for (const uvec3& t : scene.topology().triangles) {
        bool finite = true;
        for (int i = 0; i < 3; ++i) finite = finite && is_finite_vertex(scene.positions[t[i]]);
        for (int i = 0; i < 3; ++i) {
            const vec3 p = finite ? scene.positions[t[i]] : vec3(0, 0, 0);
            corners.emplace_back(p.x, p.y, p.z, 0.0f);
        }
    }
    return corners;
}

/// The members are set one by one, because the constructor makes directions have length 1 up to
/// version 1.8 and leaves them as they are from 1.9 on.
tinybvh::Ray ray_of(const Ray& ray) {
    tinybvh::Ray theirs;
    theirs.O = {ray.org.x, ray.org.y, ray.org.z};
    theirs.D = {ray.dir.x, ray.dir.y, ray.dir.z};
    theirs.rD = tinybvh::tinybvh_rcp(theirs.D);
    theirs.hit.t = std::min(BVH_FAR, ray.tfar);
    theirs.hit.prim = kNoPrim;
    return theirs;
}

class TinyBvhTracer {
public:
    TinyBvhTracer(const BenchScene& scene, const TraceWork& work)
        : corners_(corners_of(scene)), work_(&work), answers_(work) {
        bvh_.BuildHQ(corners_.data(), static_cast<std::uint32_t>(corners_.size() / 3));
    }

    void trace(const WorkPart& part) {
        for_each_tile(*work_, part, [&](const TileRays& tile) {
            for (std::size_t i = tile.begin; i < tile.end; ++i) {
                if (work_->active[i] != 0) trace(i);
            }
        });
    }

    const TraceAnswers& answers() const { return answers_; }

private:
    void trace(std::size_t i) {
        tinybvh::Ray ray = ray_of(work_->rays[i]);
        if (work_->any_hit()) {
            answers_.occluded[i] = bvh_.IsOccluded(ray) ? 1 : 0;
            return;
        }
        bvh_.Intersect(ray);
        const tinybvh::Intersection& hit = ray.hit;
        answers_.hits[i] =
            hit.t < BVH_FAR && hit.prim != kNoPrim ? Hit{hit.t, hit.u, hit.v, hit.prim} : no_hit();
    }

    std::vector<tinybvh::bvhvec4> corners_;
    tinybvh::BVH8_CPU bvh_;
    const TraceWork* work_;
    TraceAnswers answers_;
};

}  // namespace

std::vector<Peer> tinybvh_peers(const BenchScene& scene, const TraceWork& work) {
    const auto tracer = std::make_shared<TinyBvhTracer>(scene, work);
    return {{.name = fmt::format("tinybvh {}.{}.{} BVH8_CPU", TINY_BVH_VERSION_MAJOR,
                                 TINY_BVH_VERSION_MINOR, TINY_BVH_VERSION_SUB),
             .group = "tinybvh",
             .one_ray = true,
             .prepare = [] {},
             .trace = [tracer](const WorkPart& part) { tracer->trace(part); },
             .answers = [tracer] { return tracer->answers(); }}};
}

}  // namespace mray::bench
