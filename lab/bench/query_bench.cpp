#include <cmath>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "common/interop/constants.h"
#include "common/scene/camera_setup.h"
#include "lab/bench/query_work.h"
#include "lab/bench/works.h"
#include "morphray/morphray.hpp"

namespace mray::bench {
namespace {

/// Scene space as the world of the library's users, with bounds that make both the same.
constexpr double kExtent = kSceneExtent;
const morphray::Box kBounds{{-kExtent, -kExtent, -kExtent}, {kExtent, kExtent, kExtent}};
/// Distances that differ by more than this part of the scene's extent count as different.
constexpr double kMostDifference = 1e-6;

morphray::Vec3 to_user(vec3 p) { return {p.x, p.y, p.z}; }

std::span<const morphray::Vec3> to_user(std::span<const vec3> points) {
    static_assert(sizeof(morphray::Vec3) == sizeof(vec3));
    return {reinterpret_cast<const morphray::Vec3*>(points.data()), points.size()};
}

std::vector<morphray::Ray> to_user(const std::vector<Ray>& rays) {
    std::vector<morphray::Ray> result;
    for (const Ray& ray : rays)
        result.push_back({.org = to_user(ray.org), .dir = to_user(ray.dir)});
    return result;
}

/// The same scene behind the public interface and as the peers have it.
class Queries {
public:
    Queries(const Rig& rig, const BenchScene& scene)
        : rig_(rig),
          scene_(scene),
          mesh_(scene.topology(), scene.positions),
          arena_(rig.threads),
          cgal_(make_cgal_peer(scene)) {
        for (const bool robust : {true, false}) {
            for (const EmbreeDevice& device : rig.devices)
                embree_.emplace_back(device, mesh_, robust, query_count());
        }
    }

    void run() {
        const auto& triangles = scene_.topology().triangles;
        const morphray::Scene scene =
            morphray::Scene::build({.positions = morphray::packed(to_user(scene_.positions)),
                                    .triangles = {&triangles.data()->x, 3 * triangles.size()}},
                                   morphray::Device::cpu({.threads = rig_.threads}),
                                   {.bounds = kBounds, .update = morphray::Refit{}});
        const std::vector<vec3> near = points_near_surface(scene_, query_count());
        const std::vector<vec3> in_box = points_in_box(scene_, query_count());
        find_closest(scene, "near", near);
        find_closest(scene, "in box", in_box);
        count(scene, "camera", camera_rays(scene_.params), true);
        count(scene, "random", random_rays(scene_, query_count()), false);
        find_inside(scene, "near", near);
        find_inside(scene, "in box", in_box);
    }

private:
    std::size_t query_count() const {
        return std::size_t{scene_.params.width} * scene_.params.height;
    }

    void find_closest(const morphray::Scene& scene, const char* where,
                      const std::vector<vec3>& points) {
        const std::span<const morphray::Vec3> asked = to_user(points);
        std::vector<morphray::ClosestPoint> ours(points.size());
        std::vector<NearestPoint> theirs(points.size());
        const auto differs = [](double a, double b) {
            return a != b && std::abs(a - b) / (2 * kExtent) > kMostDifference;
        };
        std::vector<Method> methods = {{where, {}, [&](std::size_t) {
                                            return timed(
                                                [&] { scene.closest_points(asked, ours); });
                                        }}};
        const auto add = [&](std::string name, std::string group, const FindClosest& find) {
            const auto run = [&, find](std::size_t) {
                return timed_in(arena_, [&] { find(points, theirs); });
            };
            const auto differences = [&, run] {
                run(0);
                std::uint64_t count = 0;
                for (std::size_t i = 0; i < points.size(); ++i)
                    count += differs(ours[i].distance, theirs[i].distance);
                return count;
            };
            methods.push_back({std::move(name), {}, run, std::move(group), differences});
        };
        for (const EmbreeQueries& embree : embree_) {
            add("PointQuery " + embree.name(), embree.group(),
                [&](auto some, auto nearest) { embree.find_closest(some, nearest); });
        }
        if (cgal_.find_closest) add(cgal_.name, "cgal", cgal_.find_closest);
        rig_.report.compare({"closest", Unit::kNs, points.size()}, methods, 1, rig_.repeat);
    }

    void count(const morphray::Scene& scene, const char* which, const std::vector<Ray>& rays,
               bool coherent) {
        const std::vector<morphray::Ray> asked = to_user(rays);
        std::vector<std::uint64_t> ours(rays.size());
        const morphray::QueryOptions known{coherent
                                               ? morphray::Coherence::image(scene_.params.width)
                                               : morphray::Coherence::sort()};
        compare_counts(
            "count", which, rays, coherent,
            [&] { scene.count(asked, ours, morphray::Crossing::each, known); },
            [&](std::size_t i, std::uint64_t hits) { return ours[i] != hits; });
    }

    /// By the rule that Embree's hits of a half-line can follow, too.
    void find_inside(const morphray::Scene& scene, const char* where,
                     const std::vector<vec3>& points) {
        const std::span<const morphray::Vec3> asked = to_user(points);
        std::vector<std::uint8_t> ours(points.size());
        compare_counts(
            "contains", where, rays_up(points), false,
            [&] { scene.contains(asked, ours, morphray::FillRule::odd); },
            [&](std::size_t i, std::uint64_t hits) { return ours[i] != hits % 2; });
    }

    /// differs(i, hits) says whether our answer i is not that of so many hits of a ray.
    template <class Run, class Differs>
    void compare_counts(const char* work, const char* where, const std::vector<Ray>& rays,
                        bool coherent, const Run& run, const Differs& differs) {
        std::vector<Method> methods = {{where, {}, [&](std::size_t) { return timed(run); }}};
        for (EmbreeQueries& embree : embree_) {
            const auto differences = [&] {
                std::uint64_t count = 0;
                for (std::size_t i = 0; i < rays.size(); ++i)
                    count += differs(i, embree.counts()[i]);
                return count;
            };
            methods.push_back({"filter, " + embree.name(),
                               {},
                               [&](std::size_t) {
                                   return timed_in(arena_, [&] { embree.count(rays, coherent); });
                               },
                               embree.group(),
                               differences});
        }
        rig_.report.compare({work, Unit::kNs, rays.size()}, methods, 1, rig_.repeat);
    }

    const Rig& rig_;
    const BenchScene& scene_;
    EmbreeMesh mesh_;
    ThreadArena arena_;
    std::deque<EmbreeQueries> embree_;
    CgalPeer cgal_;
};

}  // namespace

void bench_queries(const Rig& rig, const BenchScene& scene) { Queries(rig, scene).run(); }

}  // namespace mray::bench
