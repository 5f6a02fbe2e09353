#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/interop/constants.h"
#include "common/scene/camera_setup.h"
#include "lab/bench/cgal_tree.h"
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

std::vector<morphray::Vec3> to_user(std::span<const vec3> points) {
    std::vector<morphray::Vec3> result;
    for (const vec3& p : points) result.push_back(to_user(p));
    return result;
}

std::vector<morphray::Ray> to_user(const std::vector<Ray>& rays) {
    std::vector<morphray::Ray> result;
    for (const Ray& ray : rays)
        result.push_back({.org = to_user(ray.org), .dir = to_user(ray.dir)});
    return result;
}

struct QueryPeer {
    std::string name;
    std::string group;
    std::function<void()> run;
    /// How many answers of its last run differ from ours.
    std::function<std::uint64_t()> differences;
};

/// The same scene behind the public interface and as the peers have it.
class Queries {
public:
    Queries(const Rig& rig, const BenchScene& scene)
        : rig_(rig),
          scene_(scene),
          points_(to_user(scene.positions)),
          mesh_(scene.topology(), scene.positions),
          arena_(rig.threads),
          cgal_(make_cgal_tree(scene)) {
        for (const bool robust : {true, false}) {
            for (const EmbreeDevice& device : rig.devices)
                embree_.emplace_back(device, mesh_, robust, query_count());
        }
    }

    void run() {
        const auto& triangles = scene_.topology().triangles;
        const morphray::Scene scene =
            morphray::Scene::build({.positions = morphray::packed(points_),
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
    /// As many as the image has pixels.
    std::size_t query_count() const {
        return std::size_t{scene_.params.width} * scene_.params.height;
    }

    void find_closest(const morphray::Scene& scene, const char* where,
                      const std::vector<vec3>& points) {
        const std::vector<morphray::Vec3> asked = to_user(points);
        std::vector<morphray::ClosestPoint> ours(points.size());
        std::vector<NearestPoint> theirs(points.size());
        const auto differences = [&] {
            std::uint64_t count = 0;
            for (std::size_t i = 0; i < points.size(); ++i) {
                const double a = ours[i].distance;
                const double b = theirs[i].distance;
                const double difference = a == b ? 0 : std::abs(a - b) / (2 * kExtent);
                count += difference > kMostDifference;
            }
            return count;
        };
        std::vector<QueryPeer> peers;
        for (EmbreeQueries& embree : embree_) {
            peers.push_back({"PointQuery " + embree.name(), embree.group(),
                             [&] { embree.find_closest(points, theirs); }, differences});
        }
        if (cgal_) {
            peers.push_back(
                {cgal_->name(), "cgal", [&] { cgal_->find_closest(points, theirs); }, differences});
        }
        report(
            "closest", where, points.size(), [&] { scene.closest_points(asked, ours); }, peers);
    }

    void count(const morphray::Scene& scene, const char* which, const std::vector<Ray>& rays,
               bool coherent) {
        const std::vector<morphray::Ray> asked = to_user(rays);
        std::vector<std::uint64_t> ours(rays.size());
        const morphray::QueryOptions known{coherent
                                               ? morphray::Coherence::image(scene_.params.width)
                                               : morphray::Coherence::sort()};
        const auto differs = [](std::uint64_t a, std::uint64_t b) { return a != b; };
        report(
            "count", which, rays.size(),
            [&] { scene.count(asked, ours, morphray::Crossing::each, known); },
            counting_peers(rays, coherent, ours, differs));
    }

    /// By the rule that Embree's hits of a half-line can follow, too.
    void find_inside(const morphray::Scene& scene, const char* where,
                     const std::vector<vec3>& points) {
        const std::vector<morphray::Vec3> asked = to_user(points);
        const std::vector<Ray> rays = rays_up(points);
        std::vector<std::uint8_t> ours(points.size());
        const auto differs = [](std::uint8_t inside, std::uint64_t hits) {
            return inside != hits % 2;
        };
        report(
            "contains", where, points.size(),
            [&] { scene.contains(asked, ours, morphray::FillRule::odd); },
            counting_peers(rays, false, ours, differs));
    }

    template <class Answer, class Differs>
    std::vector<QueryPeer> counting_peers(const std::vector<Ray>& rays, bool coherent,
                                          const std::vector<Answer>& ours, Differs differs) {
        std::vector<QueryPeer> peers;
        for (EmbreeQueries& embree : embree_) {
            peers.push_back({"filter, " + embree.name(), embree.group(),
                             [&, coherent] { embree.count(rays, coherent); },
                             [&, differs] {
                                 std::uint64_t count = 0;
                                 for (std::size_t i = 0; i < ours.size(); ++i)
                                     count += differs(ours[i], embree.counts()[i]);
                                 return count;
                             }});
        }
        return peers;
    }

    template <class Run>
    void report(const char* work, const char* where, std::size_t count, const Run& run,
                const std::vector<QueryPeer>& peers) {
        std::vector<Method> methods = {{where, {}, [&](std::size_t) { return timed(run); }}};
        for (const QueryPeer& peer : peers) {
            methods.push_back({peer.name,
                               {},
                               [&](std::size_t) { return timed_in(arena_, peer.run); },
                               peer.group});
        }
        compare_with_peers(rig_, work, methods, 1, Unit::kNs, count, [&](std::size_t peer) {
            methods[peer].run(0);
            return peers[peer - 1].differences();
        });
    }

    const Rig& rig_;
    const BenchScene& scene_;
    std::vector<morphray::Vec3> points_;
    EmbreeMesh mesh_;
    ThreadArena arena_;
    std::deque<EmbreeQueries> embree_;
    std::unique_ptr<CgalTree> cgal_;
};

}  // namespace

void bench_queries(const Rig& rig, const BenchScene& scene) { Queries(rig, scene).run(); }

}  // namespace mray::bench
